#include "sila/gp/config.hpp"

#include <cmath>
#include <stdexcept>

#include "core/concatenate.hpp"

namespace sila {

bool operator==(const Hyperparameters& a, const Hyperparameters& b) {
  return a.kernel == b.kernel && a.noise_variance == b.noise_variance;
}

void validate(const Hyperparameters& hyperparameters) {
  validate(hyperparameters.kernel);
  const double noise = hyperparameters.noise_variance;
  if (noise > 0.0 && std::isfinite(noise)) return;
  throw std::invalid_argument(
      concatenate("hyperparameters: noise_variance = ", noise, ", must be positive and finite"));
}

void validate(const GpConfig& config) {
  validate_fields("gp", config);
}

}  // namespace sila
