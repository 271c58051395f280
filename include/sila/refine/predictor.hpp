#pragma once

#include <optional>
#include <vector>

#include "sila/model/model.hpp"
#include "sila/predict/flow_field_index.hpp"
#include "sila/predict/predict.hpp"
#include "sila/refine/config.hpp"
#include "sila/refine/regions.hpp"
#include "sila/refine/stacking.hpp"

namespace sila {
struct Snapshot;

/// Merged and normalised roll-outs, and what is known without one. They live in the scratch memory.
struct MergedRollouts {
  std::span<const Rollout> rollouts;
  std::span<const ResidualPrediction> residuals;  ///< for each, of the transitions that do not support another mode
  ObservedFeatures seen;
  double raw_novelty = 1.0;
};

/// A model made ready to predict thousands of tracks; immutable, may be used from many threads.
class Predictor {
 public:
  /// Throws: std::invalid_argument for a configuration out of range.
  Predictor(const Model& model, const RefineConfig& config);

  /// The next seconds of a person as weighted modes; always an answer.
  /// Units: `observed` in curb units, sampled at the model's interval, ending at t0; the prediction in metres,
  /// world frame. Throws: std::invalid_argument for a track that breaks its invariant or has another sampling interval.
  /// Source: SILA paper, section on prediction; docs/predict.md.
  Prediction predict(const CurbTrajectory& observed) const;
  /// The same, and once the workspace is as large as it has to be without allocating; valid until it is used again.
  const Prediction& predict(const CurbTrajectory& observed, Workspace& workspace) const;

  /// Steps towards a prediction, over at least `steps` steps; error statistics and explanations are made from them.
  RolloutSet rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  ObservedFeatures observe(const CurbTrajectory& observed, const RolloutSet& set, Scratch& scratch) const;
  MergedRollouts merged_rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  const Prediction& predict(const CurbTrajectory& observed, const MergedRollouts& merged, Workspace& workspace) const;

  const RefineConfig& config() const { return config_; }
  double interval_s() const { return interval_s_; }
  const FlowFieldIndex& map() const { return map_; }
  /// What past errors fitted of a trained site, or of all sites together.
  const Stacking& stacking(std::optional<int> site) const { return fitted(site).stacking; }

 private:
  friend struct Snapshot;
  Predictor(const Model& model, const RefineConfig& config, const Snapshot* earlier);

  struct Fitted {
    Stacking stacking;
    Calibration calibration;
  };
  const Fitted& fitted(std::optional<int> site) const {
    return site ? by_site_[static_cast<std::size_t>(*site)] : elsewhere_;
  }
  void add_stacked_modes(const CurbTrajectory& observed, const MergedRollouts& merged, bool fallback, bool here,
                         Workspace& workspace) const;
  Fitted fitted_to(const ErrorStatistics& error_statistics) const;

  RefineConfig config_;
  PredictConfig rollout_config_;
  double interval_s_;
  FlowFieldIndex map_;
  ResidualIndex residuals_;
  Fitted elsewhere_;             ///< by the error statistics of all sites together
  std::vector<Fitted> by_site_;  ///< by those of each site, shrunk to the others
};

/// One prediction; for many tracks make a Predictor.
Prediction predict(const Model& model, const CurbTrajectory& observed, const RefineConfig& config);

}  // namespace sila
