#include "sila/refine/prior.hpp"

#include <stdexcept>

#include "refine/error_statistics.hpp"

namespace sila {

Model make_prior(std::span<const Model> models) {
  Model prior;
  if (!models.empty()) prior.settings = models.front().settings;
  for (const Model& model : models) accumulate(prior.prior, pooled_error_statistics(model, false));
  if (!(windows_in(prior.prior.density) > 0.0))
    throw std::invalid_argument("make_prior: the models have no error statistics");
  forget_positions(prior.prior);
  return prior;
}

}  // namespace sila
