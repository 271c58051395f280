#pragma once

#include <concepts>
#include <type_traits>

#include "sila/predict/config.hpp"

namespace sila {

/// Prediction with the refinement: the paper's settings, and those of what is added to it.
struct RefineConfig : PredictConfig {
  bool stacking = true;
  int mode_variants = 4;
  double variant_weight = 0.002;
  /// Distance of a variant from its mode [standard deviations].
  static constexpr double variant_reach = 0.9;
  /// Maximum effective sample size of the global residual GP at an untrained site.
  static constexpr double max_effective_samples = 25.0;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, RefineConfig>
void fields(Config& config, Visitor&& visit) {
  std::conditional_t<std::is_const_v<Config>, const PredictConfig, PredictConfig>& paper = config;
  fields(paper, visit);
  visit.flag("stacking", config.stacking,
             "stack kinematics and residual GPs by ridge regression on past errors (paper: off)");
  visit.number("mode_variants", config.mode_variants, Range{0, 4}, "-",
               "lighter modes beside the most likely one, in pairs: slower and faster, left and right (paper: 0)");
  visit.number("variant_weight", config.variant_weight, Range{0.0, 0.1, true}, "-",
               "share of its mode's weight that each variant gets");
}

/// What the roll-outs are made with: where there will be variants, one pair of them finds room beside the modes.
inline PredictConfig rollout_config(const RefineConfig& config) {
  constexpr int pair = 2;
  PredictConfig result = config;
  if (config.stacking && config.mode_variants >= pair && config.max_modes > pair) result.max_modes -= pair;
  return result;
}

}  // namespace sila
