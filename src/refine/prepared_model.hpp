#pragma once

#include <optional>
#include <span>
#include <vector>

#include "predict/flow_field_index.hpp"
#include "predict/predict.hpp"
#include "refine/regions.hpp"
#include "refine/stacking.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// Merged roll-outs with normalised weights, and the features of the person. They live in the scratch memory.
struct MergedRollouts {
  std::span<const Rollout> rollouts;
  /// One for each roll-out: all experts except those that belong to other modes only.
  std::span<const ResidualPrediction> residuals;
  ObservedFeatures seen;
  double raw_novelty = 1.0;
};

/// A model prepared once for many predictions, and the steps of a prediction. Immutable.
class PreparedModel {
 public:
  /// Posteriors of GPs that are equal in an earlier model are taken from its preparation.
  /// Throws: std::invalid_argument for a configuration out of range.
  PreparedModel(const Model& model, const RefineConfig& config, const Model* earlier = nullptr,
                const PreparedModel* of_earlier = nullptr);

  /// The roll-outs over at least `steps` steps.
  RolloutSet rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  ObservedFeatures observe(const CurbTrajectory& observed, const RolloutSet& set, Scratch& scratch) const;
  MergedRollouts merged_rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  /// The prediction from merged roll-outs of at least the configured horizon; valid until the workspace is used again.
  const Prediction& predict(const CurbTrajectory& observed, const MergedRollouts& merged, Workspace& workspace) const;

  const RefineConfig& config() const { return config_; }
  double interval_s() const { return interval_s_; }
  CurbScaling scaling() const { return scaling_; }
  const FlowFieldIndex& fields() const { return fields_; }
  /// Fitted to the past errors of a trained site, or of all sites together.
  const Stacking& stacking(std::optional<int> site) const { return fitted(site).stacking; }

 private:
  struct Fitted {
    Stacking stacking;
    Calibration calibration;
  };
  const Fitted& fitted(std::optional<int> site) const {
    return site ? by_site_[static_cast<std::size_t>(*site)] : untrained_;
  }
  /// Before errors are known: the paper's modes; without roll-outs the residual GPs alone, which are better than
  /// constant velocity.
  void add_unfitted_modes(const CurbTrajectory& observed, const MergedRollouts& merged, Workspace& workspace) const;
  void add_stacked_modes(const MergedRollouts& merged, const HazardFeatures& hazard,
                         const VelocityCorrection& correction, Workspace& workspace) const;
  Fitted fitted_to(const ErrorStatistics& error_statistics) const;

  RefineConfig config_;
  PredictConfig rollout_config_;
  double interval_s_;
  CurbScaling scaling_;
  FlowFieldIndex fields_;
  ResidualIndex residuals_;
  Fitted untrained_;             ///< for untrained sites: by the error statistics of all sites together
  std::vector<Fitted> by_site_;  ///< by those of each site, shrunk to the others
};

/// The steps towards a prediction, for error statistics and explanations.
const PreparedModel& prepared_in(const Predictor& predictor);

}  // namespace sila
