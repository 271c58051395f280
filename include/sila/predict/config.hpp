#pragma once

#include "sila/core/fields.hpp"

namespace sila {

/// The prior of a transition, which multiplies its likelihood in its weight.
enum class WeightPrior {
  local_support,           ///< number of samples that support its field at the position
  transition_probability,  ///< P(j | i) = T(i, j) / sum_k T(i, k) (paper)
  none,
};
inline constexpr const char* kWeightPriors[] = {"local_support", "transition_probability", "none"};

/// The paper's prediction; sila/refine/config.hpp adds to it.
struct PredictConfig {
  double observe_s = 3.2;
  double min_observe_s = 0.4;
  double horizon_s = 5.0;
  double mode_horizon_s = 5.0;
  int max_modes = 8;
  int max_shortlisted = 24;
  int max_candidates = 4;
  /// Maximum number of open branches while transitions are chained.
  static constexpr int max_branches = 12;
  double likelihood_s = 1.6;
  double likelihood_power = 0.25;
  WeightPrior prior = WeightPrior::local_support;
  /// A field knows a position if var/sigma_f^2 is below this.
  static constexpr double support_ratio = 0.5;
  /// A roll-out has left its field if var/sigma_f^2 is above this.
  static constexpr double leave_ratio = 0.7;
  int min_supported_samples = 3;
  /// Modes lighter than this share of the heaviest are dropped.
  static constexpr double min_relative_weight = 0.01;
  double merge_radius_m = 2.0;
  /// Correlation time of a pedestrian's deviation from the field [s].
  static constexpr double noise_correlation_s = 1.6;
  bool own_deviation = false;
};

void fields(MaybeConst<PredictConfig> auto& config, auto&& visit) {
  visit.number("observe_s", config.observe_s, Range{0.2, 60.0}, "s", "observed time before t0, at most");
  visit.number("min_observe_s", config.min_observe_s, Range{0.0, 60.0, true}, "s",
               "age of a track at its first prediction");
  visit.number("horizon_s", config.horizon_s, Range{0.0, 60.0, true}, "s", "predicted time after t0");
  visit.number("mode_horizon_s", config.mode_horizon_s, Range{0.0, 60.0, true}, "s",
               "modes branch and merge by their paths until then, so that a longer horizon_s only extends them");
  visit.number("max_modes", config.max_modes, Range{1, 100}, "", "maximum number of modes");
  visit.number("max_shortlisted", config.max_shortlisted, Range{1, 100000}, "",
               "maximum number of transitions evaluated; if more overlap, those that best match the current velocity");
  visit.number("max_candidates", config.max_candidates, Range{1, 1000}, "", "maximum number of transitions rolled out");
  visit.number("likelihood_s", config.likelihood_s, Range{0.2, 60.0}, "s",
               "last part of the observed window that scores transitions");
  visit.number("likelihood_power", config.likelihood_power, Range{0.0, 1.0}, "",
               "exponent of the likelihood; below 1 because successive velocities are correlated (paper: 1)");
  visit.choice("prior", config.prior, kWeightPriors, "prior that multiplies the likelihood of a transition");
  visit.number("min_supported_samples", config.min_supported_samples, Range{0, 1000}, "samples",
               "minimum number of observed samples at positions that a field knows");
  visit.number("merge_radius_m", config.merge_radius_m, Range{0.0, 1000.0}, "m",
               "modes with a smaller mean distance are merged");
  visit.flag("own_deviation", config.own_deviation,
             "start a roll-out with the pedestrian's own deviation from the field, which decays with a time constant "
             "of 1.6 s");
}

}  // namespace sila
