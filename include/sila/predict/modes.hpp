#pragma once

#include <vector>

#include "sila/predict/rollout.hpp"

namespace sila {

/// Replaces roll-outs that stay within `merge_radius_m` of a heavier one (mean distance over the first
/// `decision_steps`) by their weighted mean, keeps the `max_modes` heaviest, and normalises the weights. The spread of
/// the members is added to the covariances. Returns them heaviest first; nothing for nothing.
std::vector<Rollout> merge_rollouts(std::vector<Rollout> rollouts, const CurbFrame& frame, int decision_steps,
                                    const PredictConfig& config);

}  // namespace sila
