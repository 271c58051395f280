#pragma once

#include <optional>
#include <span>
#include <vector>

#include "predict/flow_field_index.hpp"
#include "predict/rollout.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// The roll-outs of one observed path. They live in the scratch memory that they were made with.
struct RolloutSet {
  std::optional<int> site;               ///< null: an untrained site
  std::span<const int> near;             ///< transitions whose field may cover the position
  std::span<const Rollout> rollouts;     ///< empty if no transition matches
  std::span<const RolloutGroup> groups;  ///< of roll-outs that become one mode, heaviest first
  double raw_novelty = 1.0;              ///< see Candidates
};

/// Selects the transitions that a pedestrian may be in, rolls them out over at least `steps` steps of `interval_s`, and
/// groups the roll-outs.
/// Source: SILA paper, section on prediction; docs/predict.md.
RolloutSet roll_out_near(const FlowFieldIndex& fields, const CurbTrajectory& observed, int steps, double interval_s,
                         bool with_covariances, const PredictConfig& config, Scratch& scratch);

/// A prediction without modes, of `steps` steps after t0, in the memory of the last prediction.
Prediction& begin_prediction(const CurbTrajectory& observed, std::size_t steps, double interval_s,
                             Workspace& workspace);

/// Adds a mode to the prediction, in the memory of an earlier mode: the path and the covariances have a step for each
/// of `times_s`, but no values.
Mode& add_mode(Workspace& workspace, double weight);

/// Appends the primitives of a chain of transitions; equal neighbours count once.
void visit_primitives(const FlowFieldIndex& fields, std::span<const int> transitions, std::vector<int>& visited);

/// Sorts by weight, heaviest first; modes of equal weight keep their order.
void sort_by_weight(std::vector<Mode>& modes);

/// A mode for each merged roll-out; without any, constant velocity.
/// Source: SILA paper, section on prediction.
void add_rollout_modes(const FlowFieldIndex& fields, std::span<const Rollout> rollouts, const CurbTrajectory& observed,
                       double interval_s, Workspace& workspace);

/// Throws: std::invalid_argument for a track that breaks its invariant or has another sampling interval.
void require_observed(const CurbTrajectory& observed, double interval_s);

/// The prediction of the paper: roll-outs of the flow fields alone. Units: `observed` in curb units, sampled every
/// `interval_s`, ending at t0; the prediction in metres, world frame. Throws: std::invalid_argument for a track that
/// breaks its invariant or has another sampling interval.
/// Source: SILA paper, section on prediction; docs/predict.md.
Prediction predict_by_rollouts(const FlowFieldIndex& fields, const CurbTrajectory& observed, double interval_s,
                               const PredictConfig& config);

}  // namespace sila
