#pragma once

#include <span>

#include "predict/candidates.hpp"

namespace sila {

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
/// transitions that follow in the graph and know the place, weighted by P(k | j); with none it keeps its last velocity.
/// Branching stops at `mode_horizon_s`; from there the most likely successor is taken, so that a longer horizon only
/// adds to a shorter one. The paths live in `scratch`. Source: docs/predict.md, section 2.
std::span<Rollout> roll_out(const FlowFieldIndex& map, const Candidates& candidates, const CurbTrajectory& observed,
                            int steps, double interval_s, bool with_covariances, const PredictConfig& config,
                            Scratch& scratch);

}  // namespace sila
