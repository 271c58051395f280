#pragma once

#include <type_traits>

#include "sila/core/fields.hpp"
#include "sila/predict/config.hpp"

namespace sila {

/// How residual GPs are learnt: for each transition, a sparse GP from (position, velocity, mean velocity) to the
/// deviation of the future path from constant velocity. Lengths in metres become curb units when a model begins.
/// Source: none in the paper; docs/decisions/0070-residuals.md.
struct ResidualConfig {
  bool enabled = true;
  /// Number of evenly spaced times until the horizon at which the deviation is learnt.
  static constexpr int knots = 4;
  double place_scale_m = 1.3;
  double velocity_scale_mps = 0.45;
  double mean_velocity_scale_mps = 0.5;
  /// Prior standard deviation [m/s].
  static constexpr double signal_std_mps = 0.4;
  /// Noise: standard deviation between pedestrians with the same inputs [m/s].
  static constexpr double noise_std_mps = 0.25;
  /// Time between two samples of a track [s].
  static constexpr double stride_s = 0.8;
  /// Minimum part of the future that a sample needs [of the horizon].
  static constexpr double min_seen_share = 0.75;
  int max_pseudo_inputs = 120;
  /// Selection of pseudo-inputs stops when every conditional variance is below this [of the signal variance].
  static constexpr double selection_stop = 0.1;
};

void fields(MaybeConst<ResidualConfig> auto& config, auto&& visit) {
  visit.flag("enabled", config.enabled, "learn residual GPs: deviations from constant velocity (paper: off)");
  visit.number("place_scale_m", config.place_scale_m, Range{0.05, 100.0}, "m", "length scale of the position");
  visit.number("velocity_scale_mps", config.velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 0.8 s");
  visit.number("mean_velocity_scale_mps", config.mean_velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 3 s");
  visit.number("max_pseudo_inputs", config.max_pseudo_inputs, Range{1, 1000}, "",
               "maximum number of pseudo-inputs of a residual GP");
}

/// Prediction with the refinement: the paper's settings and those of the additions.
struct RefineConfig : PredictConfig {
  bool stacking = true;
  int mode_variants = 5;
  /// Weight of a variant [of its mode], so small that the weighted error hardly changes
  /// (docs/decisions/0072-mode_variants.md).
  static constexpr double variant_weight = 0.002;
};

void fields(MaybeConst<RefineConfig> auto& config, auto&& visit) {
  using Paper = std::conditional_t<std::is_const_v<std::remove_reference_t<decltype(config)>>, const PredictConfig,
                                   PredictConfig>;
  fields(static_cast<Paper&>(config), visit);
  visit.flag("stacking", config.stacking,
             "stack kinematics and residual GPs by ridge regression on past errors (paper: off)");
  visit.number("mode_variants", config.mode_variants, Range{0, 5}, "",
               "lighter modes around the most likely one: slower, faster, left, right (paper: 0)");
}

}  // namespace sila
