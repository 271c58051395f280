#pragma once

#include <vector>

#include "sila/predict/rollout.hpp"

namespace sila {

/// Which roll-outs become one mode: those that stay within `merge_radius_m` of a heavier one (mean distance over the
/// first `decision_steps`). Heaviest group first, at most `max_modes` (two fewer where alternatives are wanted); the
/// heaviest member of each comes first.
std::vector<std::vector<std::size_t>> group_rollouts(const std::vector<Rollout>& rollouts, const CurbFrame& frame,
                                                     int decision_steps, const PredictConfig& config);

/// The weighted mean of each group, weights normalised. The spread of the members is added to the covariances.
std::vector<Rollout> merge_rollouts(const std::vector<Rollout>& rollouts,
                                    const std::vector<std::vector<std::size_t>>& groups);

}  // namespace sila
