#pragma once

#include <cstddef>
#include <span>

#include "predict/rollout.hpp"

namespace sila {

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
