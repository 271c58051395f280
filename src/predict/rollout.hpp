#pragma once

#include <cstddef>
#include <span>

#include "predict/flow_field_index.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// A transition that the person may be in.
struct Candidate {
  int transition = 0;
  double log_likelihood = 0.0;  ///< of the observed velocities under its field
  double log_prior = 0.0;
  double score = 0.0;  ///< likelihood_power * log_likelihood + log_prior
};

struct Candidates {
  std::span<Candidate> list;  ///< best first, at most max_candidates, each at least min_relative_weight of the best
  double raw_novelty = 1.0;   ///< mean over the scored samples of var / sigma_f^2 of the field that knows it best
};

/// Selects, from the transitions nearby, those whose fields cover the last observed point and enough points before it;
/// scores them by the likelihood of the observed velocities. Source: docs/predict.md, section 1.
Candidates find_candidates(const FlowFieldIndex& fields, std::span<const int> near, const CurbTrajectory& observed,
                           const PredictConfig& config, Scratch& scratch);

/// The path along a chain of transitions, in curb coordinates.
struct Rollout {
  double weight = 0.0;                   ///< relative; not normalised
  std::span<const Vector2> path;         ///< of a person who follows the fields
  std::span<const Matrix2> covariances;  ///< of `path`, from the fields' variance and noise; none unless asked for
  std::span<const int> transitions;      ///< in order
  Candidate origin;                      ///< the candidate from which it began
  double chain_probability = 1.0;        ///< of the branches that it took
};

/// Follows each candidate for `steps` steps of `interval_s`. Where a path leaves its field it branches into the
/// transitions that follow in the graph and know the position, weighted by P(k | j); with none it keeps its last
/// velocity. Branching stops at `mode_horizon_s`; from there the most likely successor is taken, so that a longer
/// horizon only adds to a shorter one. The paths live in `scratch`. Source: docs/predict.md, section 2.
std::span<Rollout> roll_out(const FlowFieldIndex& fields, const Candidates& candidates, const CurbTrajectory& observed,
                            int steps, double interval_s, bool with_covariances, const PredictConfig& config,
                            Scratch& scratch);

/// Numbers of the roll-outs that become one mode.
using RolloutGroup = std::span<const std::size_t>;

/// Groups the roll-outs that become one mode: those within `merge_radius_m` of a heavier one (mean distance over the
/// first `decision_steps`). Heaviest group first, at most `max_modes`; in each group the heaviest member first.
std::span<const RolloutGroup> group_rollouts(std::span<const Rollout> rollouts, const CurbFrame& frame,
                                             int decision_steps, const PredictConfig& config, Scratch& scratch);

/// The weighted mean of each group, weights normalised. The spread of the members is added to the covariances.
std::span<Rollout> merge_rollouts(std::span<const Rollout> rollouts, std::span<const RolloutGroup> groups,
                                  Scratch& scratch);

}  // namespace sila
