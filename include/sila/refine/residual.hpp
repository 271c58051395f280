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
  int knots = 4;
  double place_scale_m = 2.0;
  double velocity_scale_mps = 0.45;
  double mean_velocity_scale_mps = 0.5;
  double signal_std_mps = 0.4;
  double noise_std_mps = 0.33;
  double every_s = 0.8;
  double min_seen_share = 0.75;
  int max_pseudo_inputs = 120;
  double selection_stop = 0.1;
  double keep_pseudo_inputs_share = GpConfig().keep_pseudo_inputs_share;
  double global_scale_mps = 0.9;
  int global_pseudo_inputs = 40;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ResidualConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("enabled", config.enabled, "learn residual GPs: deviations from constant velocity (paper: off)");
  visit.number("knots", config.knots, Range{1, 20}, "-", "number of times until the horizon at which they are learnt");
  visit.number("place_scale_m", config.place_scale_m, Range{0.05, 100.0}, "m", "length scale of the position");
  visit.number("velocity_scale_mps", config.velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 0.8 s");
  visit.number("mean_velocity_scale_mps", config.mean_velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "length scale of the velocity of the last 3 s");
  visit.number("signal_std_mps", config.signal_std_mps, Range{0.01, 20.0}, "m/s", "prior standard deviation");
  visit.number("noise_std_mps", config.noise_std_mps, Range{0.01, 20.0}, "m/s",
               "noise: how much pedestrians with the same inputs differ");
  visit.number("every_s", config.every_s, Range{0.0, 60.0, true}, "s", "time between two samples of a track");
  visit.number("min_seen_share", config.min_seen_share, Range{0.0, 1.0, true}, "of the horizon",
               "minimum part of the future that a sample needs");
  visit.number("max_pseudo_inputs", config.max_pseudo_inputs, Range{1, 1000}, "-",
               "maximum number of pseudo-inputs of a residual GP");
  visit.number("selection_stop", config.selection_stop, Range{0.0, 1.0}, "of the signal variance",
               "selection of pseudo-inputs stops when every conditional variance is below this");
  visit.number(
      "keep_pseudo_inputs_share", config.keep_pseudo_inputs_share, Range{0.0, 1.0}, "of the points",
      "a GP at its pseudo-input limit that holds at least this share of all points keeps its pseudo-inputs when "
      "fused; 1 disables this");
  visit.number("global_scale_mps", config.global_scale_mps, Range{0.01, 100.0}, "m/s",
               "length scale of the velocities of the global residual GP");
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
