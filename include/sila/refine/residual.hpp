#pragma once

#include <concepts>
#include <optional>
#include <span>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/residual.hpp"
#include "sila/model/settings.hpp"

namespace sila {

/// How residual GPs are learnt: for each transition, a sparse GP from how a pedestrian comes along (place, velocity,
/// mean velocity) to how their path will part from constant velocity. Lengths in metres become widths when a model
/// begins. Source: none in the paper; docs/decisions/0070-residuals.md.
struct ResidualConfig {
  bool enabled = true;
  /// Number of times until the horizon at which they are learnt.
  static constexpr int knots = 4;
  double place_scale_m = 1.3;
  double velocity_scale_mps = 0.45;
  double mean_velocity_scale_mps = 0.5;
  /// Prior standard deviation [m/s].
  static constexpr double signal_std_mps = 0.4;
  /// Noise: how much pedestrians with the same inputs differ [m/s].
  static constexpr double noise_std_mps = 0.25;
  /// Time between two samples of a track [s].
  static constexpr double stride_s = 0.8;
  /// Minimum part of the future that a sample needs [of the horizon].
  static constexpr double min_seen_share = 0.75;
  int max_pseudo_inputs = 120;
  /// Selection of pseudo-inputs stops when every conditional variance is below this [of the signal variance].
  static constexpr double selection_stop = 0.1;
  /// Length scale of the velocities of the global residual GP [m/s].
  static constexpr double global_scale_mps = 0.9;
  int global_pseudo_inputs = 60;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ResidualConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("enabled", config.enabled, "learn residual GPs: deviations from constant velocity (paper: off)");
  visit.number("place_scale_m", config.place_scale_m, Range{0.05, 100.0}, "m", "length scale of the position");
  visit.number("velocity_scale_mps", config.velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 0.8 s");
  visit.number("mean_velocity_scale_mps", config.mean_velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 3 s");
  visit.number("max_pseudo_inputs", config.max_pseudo_inputs, Range{1, 1000}, "-",
               "maximum number of pseudo-inputs of a residual GP");
  visit.number("global_pseudo_inputs", config.global_pseudo_inputs, Range{1, 1000}, "-",
               "maximum number of pseudo-inputs of the global residual GP");
}

ResidualInput residual_input(const CurbTrajectory& observed);

/// The example of an observed path and its future (at the path's interval), if at least `min_seen_share` of the horizon
/// was seen; the last that was seen then stands for later knots. `settings` say where the knots are.
std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const ModelSettings& settings, double min_seen_share);

Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config);

/// How the sparse GPs of residual GPs are fitted and fused: their mean is zero, so that far from all examples constant
/// velocity is left.
GpConfig residual_gp_config(const ResidualConfig& config);

}  // namespace sila
