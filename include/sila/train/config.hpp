#pragma once

#include "sila/core/sampling.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"
#include "sila/refine/config.hpp"
#include "sila/refine/prune.hpp"

namespace sila {

/// Statistics of the errors of predictions made before a batch is learnt. The numbers are not validated: they must be
/// positive.
struct ErrorStatisticsConfig {
  bool enabled = true;
  /// Time between two windows of a track [s].
  double stride_s = 1.6;
  /// After this number of newer windows an error counts 1/e. Not a setting; in distributed training it is infinite.
  double memory_windows = 5000.0;
};

void fields(MaybeConst<ErrorStatisticsConfig> auto& config, auto&& visit) {
  visit.flag("enabled", config.enabled, "predict each batch before it is learnt, and calibrate by the errors");
}

/// All settings of learning and predicting.
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
  RefineConfig predict;
};

void fields(MaybeConst<EpisodeConfig> auto& config, auto&& visit) {
  visit.group("sampling", config.sampling);
  visit.choice("scaling", config.scaling, kCurbScalings,
               "unit of the curb coordinates: metres, or the mean sidewalk width (paper)");
  visit.number("reference_width_m", config.reference_width_m, Range{0.0, 100.0}, "m",
               "sidewalk width by which metres become widths of the model, 0.1 or more, the same for models that are "
               "to be fused; 0: that of the site where the model begins; with scaling = metres always 0");
  visit.group("learn", config.learn);
  visit.group("residual", config.residual);
  visit.group("fuse", config.fuse);
  visit.group("prune", config.prune);
  visit.group("budget", config.budget);
  visit.group("error_statistics", config.error_statistics);
  visit.group("predict", config.predict);
}

/// Throws: std::invalid_argument for a field out of its range and for fields that contradict each other.
void validate(const EpisodeConfig& config);

}  // namespace sila
