#pragma once

#include <concepts>

#include "sila/core/fields.hpp"

namespace sila {

/// What multiplies the likelihood of a transition in its weight.
enum class WeightPrior {
  local_evidence,          ///< how many samples support its field right here
  transition_probability,  ///< P(j | i) = T(i, j) / sum_k T(i, k) (paper)
  none,
};
inline constexpr const char* kWeightPriors[] = {"local_evidence", "transition_probability", "none"};

/// Prediction; `profile: paper` sets the paper's method alone (see experiments/paper.json).
struct PredictConfig {
  double observe_s = 3.2;
  double horizon_s = 5.0;
  double mode_horizon_s = 5.0;
  int max_modes = 6;
  int max_asked = 24;
  int max_candidates = 4;
  int max_branches = 12;
  double evidence_s = 1.6;
  double likelihood_power = 0.25;
  WeightPrior prior = WeightPrior::local_evidence;
  double support_ratio = 0.5;
  double leave_ratio = 0.7;
  int min_supported_samples = 3;
  double min_relative_weight = 0.01;
  bool chaining = true;
  double merge_radius_m = 2.0;
  bool blend = true;
  bool known_places_only = true;
  double gait_examples_elsewhere = 25.0;
  double blend_ridge = 7.0;
  double blend_class_ridge = 50.0;
  int alternatives = 4;
  double alternative_weight = 0.01;
  double alternative_reach = 0.9;
  double own_speed_relaxation_s = 0.8;
  double noise_correlation_s = 1.6;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, PredictConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("observe_s", config.observe_s, Range{0.2, 60.0}, "s", "how much of a track is looked at before t0");
  visit.number("horizon_s", config.horizon_s, Range{0.0, 60.0, true}, "s", "how far ahead is predicted");
  visit.number(
      "mode_horizon_s", config.mode_horizon_s, Range{0.0, 60.0, true}, "s",
      "modes branch and merge by what they do until then, so that a longer horizon_s only adds to a shorter one");
  visit.number("max_modes", config.max_modes, Range{1, 100}, "-", "most modes of a prediction");
  visit.number("max_asked", config.max_asked, Range{1, 100000}, "-",
               "most transitions that are asked; where more overlap, those that are likeliest to move somebody so");
  visit.number("max_candidates", config.max_candidates, Range{1, 1000}, "-", "most transitions that are rolled out");
  visit.number("max_branches", config.max_branches, Range{1, 1000}, "-",
               "most open branches while transitions are chained");
  visit.number("evidence_s", config.evidence_s, Range{0.2, 60.0}, "s",
               "the last part of the observed window that scores transitions");
  visit.number("likelihood_power", config.likelihood_power, Range{0.0, 1.0}, "-",
               "exponent of the likelihood; below 1 because successive velocities are correlated (paper: 1)");
  visit.choice("prior", config.prior, kWeightPriors, "what multiplies the likelihood");
  visit.number("support_ratio", config.support_ratio, Range{0.0, 1.0, true}, "-",
               "a field knows a place where var/sigma_f^2 is below it");
  visit.number("leave_ratio", config.leave_ratio, Range{0.0, 1.0, true}, "-",
               "a roll-out has left its field where var/sigma_f^2 is above it");
  visit.number("min_supported_samples", config.min_supported_samples, Range{0, 1000}, "samples",
               "observed samples a field must know");
  visit.number("min_relative_weight", config.min_relative_weight, Range{0.0, 1.0}, "-",
               "modes lighter than this share of the best are left out");
  visit.flag("chaining", config.chaining, "follow the graph of primitives when a roll-out leaves its field");
  visit.number("merge_radius_m", config.merge_radius_m, Range{0.0, 1000.0}, "m",
               "modes nearer than this on average become one");
  visit.flag("blend", config.blend, "blend roll-outs with kinematics as past errors taught");
  visit.flag("known_places_only", config.known_places_only,
             "at a corner where nothing was learnt trust only what does not depend on the place");
  visit.number("gait_examples_elsewhere", config.gait_examples_elsewhere, Range{0.0, 1e9, true}, "-",
               "at such a corner all that is known of walking counts as so many examples at most");
  visit.number(
      "blend_ridge", config.blend_ridge, Range{0.0, 1e6}, "-",
      "trust in outlooks (where none: constant velocity) against what errors at all speeds taught, in units of their "
      "variance");
  visit.number(
      "blend_class_ridge", config.blend_class_ridge, Range{0.0, 1e6}, "-",
      "trust in what errors at all speeds taught against those at one speed, and in the blend without a roll-out "
      "against that with one");
  visit.number(
      "alternatives", config.alternatives, Range{0, 4}, "-",
      "lighter modes beside the likeliest, in pairs: slower and faster, left and right; as far as max_modes has room");
  visit.number("alternative_weight", config.alternative_weight, Range{0.0, 0.1, true}, "-",
               "share that each takes of its mode's weight");
  visit.number("alternative_reach", config.alternative_reach, Range{0.0, 2.0, true}, "standard deviations",
               "how far beside its mode an alternative is");
  visit.number("own_speed_relaxation_s", config.own_speed_relaxation_s, Range{0.01, 60.0}, "s",
               "how fast the second particle, which keeps the person's own speed, turns into the field");
  visit.number("noise_correlation_s", config.noise_correlation_s, Range{0.01, 60.0}, "s",
               "how long a deviation from the field lasts");
}

}  // namespace sila
