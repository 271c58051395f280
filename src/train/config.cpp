#include "sila/train/config.hpp"

#include <stdexcept>

#include "core/concatenate.hpp"

namespace sila {
namespace {

/// Least width of a sidewalk: the coordinates of a model in widths must not become too large.
constexpr double kLeastWidth_m = 0.1;

}  // namespace

void validate(const EpisodeConfig& config) {
  validate_fields("config", config);
  const double width_m = config.reference_width_m;
  if (width_m > 0.0 && config.scaling == CurbScaling::metres) {
    throw std::invalid_argument(concatenate("config: reference_width_m = ", width_m,
                                            " has no meaning with scaling = metres; leave it 0, or choose scaling = "
                                            "mean_width"));
  }
  if (width_m > 0.0 && width_m < kLeastWidth_m) {
    throw std::invalid_argument(
        concatenate("config: reference_width_m = ", width_m, ", must be 0 or at least ", kLeastWidth_m));
  }
}

}  // namespace sila
