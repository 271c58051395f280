#pragma once

#include <concepts>
#include <limits>

#include "sila/core/sampling.hpp"
#include "sila/fuse/config.hpp"
#include "sila/learn/config.hpp"
#include "sila/refine/budget.hpp"
#include "sila/refine/config.hpp"
#include "sila/refine/prune.hpp"
#include "sila/refine/residual.hpp"

namespace sila {

/// Statistics of the errors of predictions made before a batch is learnt.
struct ErrorStatisticsConfig {
  bool enabled = true;
  /// Time between two windows of a track [s].
  double stride_s = 1.6;
  double memory_windows = 5000.0;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ErrorStatisticsConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("enabled", config.enabled, "predict each batch before it is learnt, and calibrate by the errors");
  visit.number("memory_windows", config.memory_windows, Range{1.0, std::numeric_limits<double>::infinity()}, "windows",
               "after so many newer ones an error counts 1/e");
}

/// How models that were learnt in parallel are fused, where it differs from one batch after another.
struct FleetConfig {
  bool case_3_fuses_stronger = true;
  PrimitiveMean mean = PrimitiveMean::count;
  /// Rounds in which each half is predicted by the other half; the last round calibrates.
  static constexpr int warm_up_rounds = 2;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, FleetConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("case_3_fuses_stronger", config.case_3_fuses_stronger,
             "case 3 fuses the stronger pair: halves meet once, what stays apart stays apart (paper: off)");
  visit.choice("mean", config.mean, primitive_mean_names,
               "mean of fused primitives: plain (paper), by count, over active cells");
}

struct EpisodeConfig {
  SamplingConfig sampling;
  CurbScaling scaling = CurbScaling::metres;
  double reference_width_m = 0.0;
  LearnConfig learn;
  ResidualConfig residual;
  FuseConfig fuse;
  PruneConfig prune;
  ModelBudget budget;
  ErrorStatisticsConfig error_statistics;
  FleetConfig fleet;
  RefineConfig predict;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, EpisodeConfig>
void fields(Config& config, Visitor&& visit) {
  visit.group("sampling", config.sampling);
  visit.choice("scaling", config.scaling, kCurbScalings,
               "unit of the curb coordinates: metres, the mean sidewalk width (paper), or each strip's own width");
  visit.number(
      "reference_width_m", config.reference_width_m, Range{0.0, 100.0}, "m",
      "sidewalk width by which metres become widths of the model, the same for models that are to be fused; 0: "
      "that of the site where the model begins; with scaling = metres always 0");
  visit.group("learn", config.learn);
  visit.group("residual", config.residual);
  visit.group("fuse", config.fuse);
  visit.group("prune", config.prune);
  visit.group("budget", config.budget);
  visit.group("error_statistics", config.error_statistics);
  visit.group("fleet", config.fleet);
  visit.group("predict", config.predict);
}

}  // namespace sila
