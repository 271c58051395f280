#include <algorithm>
#include <numeric>

#include "core/concatenate.hpp"
#include "predict/rollout.hpp"

namespace sila {
namespace {

double mean_distance_m(const Rollout& a, const Rollout& b, const Matrix2& world_from_curb, std::size_t steps) {
  double sum = 0.0;
  for (std::size_t j = 0; j < steps; ++j) sum += (world_from_curb * (a.path[j] - b.path[j])).norm();
  return sum / static_cast<double>(steps);
}

double weight_of(std::span<const Rollout> rollouts, RolloutGroup group) {
  double sum = 0.0;
  for (const std::size_t member : group) sum += rollouts[member].weight;
  return sum;
}

Rollout weighted_mean(std::span<const Rollout> rollouts, RolloutGroup group, Scratch& scratch) {
  Rollout mean = rollouts[group.front()];
  if (group.size() == 1) return mean;
  mean.weight = weight_of(rollouts, group);
  const auto path = scratch.array<Vector2>(mean.path.size());
  std::fill(path.begin(), path.end(), Vector2::Zero());
  for (const std::size_t index : group) {
    const Rollout& member = rollouts[index];
    for (std::size_t j = 0; j < path.size(); ++j) path[j] += member.weight / mean.weight * member.path[j];
  }
  const auto covariances = scratch.array<Matrix2>(mean.covariances.size());
  std::fill(covariances.begin(), covariances.end(), Matrix2::Zero());
  for (const std::size_t index : group) {
    const Rollout& member = rollouts[index];
    for (std::size_t j = 0; j < covariances.size(); ++j) {
      const Vector2 off = member.path[j] - path[j];
      covariances[j] += member.weight / mean.weight * (member.covariances[j] + off * off.transpose());
    }
  }
  mean.path = path;
  mean.covariances = covariances;
  return mean;
}

/// The members of each group, in order.
std::span<RolloutGroup> collect(std::span<const std::size_t> order, std::span<const std::size_t> group_of,
                                std::size_t groups, Scratch& scratch) {
  const auto list = scratch.array<RolloutGroup>(groups);
  for (std::size_t group = 0; group < groups; ++group) {
    const auto members = scratch.array<std::size_t>(order.size());
    std::size_t count = 0;
    for (const std::size_t index : order) {
      if (group_of[index] == group) members[count++] = index;
    }
    list[group] = members.first(count);
  }
  return list;
}

}  // namespace

std::span<const RolloutGroup> group_rollouts(std::span<const Rollout> rollouts, const CurbFrame& frame,
                                             int decision_steps, const PredictConfig& config, Scratch& scratch) {
  if (rollouts.empty()) return {};
  const Matrix2 matrix = world_from_curb(frame);
  const std::size_t steps =
      std::clamp<std::size_t>(static_cast<std::size_t>(decision_steps), 1, rollouts.front().path.size());
  const auto order = scratch.array<std::size_t>(rollouts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(-rollouts[i].weight, i); });
  const auto group_of = scratch.array<std::size_t>(rollouts.size());
  const auto firsts = scratch.array<std::size_t>(rollouts.size());  // the first member, the heaviest, of each group
  std::size_t count = 0;
  for (const std::size_t index : order) {
    std::size_t group = 0;
    while (group < count &&
           mean_distance_m(rollouts[firsts[group]], rollouts[index], matrix, steps) >= config.merge_radius_m) {
      ++group;
    }
    if (group == count) firsts[count++] = index;
    group_of[index] = group;
  }
  const std::span<RolloutGroup> groups = collect(order, group_of, count, scratch);
  std::ranges::sort(groups, {},
                    [&](RolloutGroup group) { return std::pair(-weight_of(rollouts, group), group.front()); });
  return groups.first(std::min(count, static_cast<std::size_t>(config.max_modes)));
}

std::span<Rollout> merge_rollouts(std::span<const Rollout> rollouts, std::span<const RolloutGroup> groups,
                                  Scratch& scratch) {
  const auto modes = scratch.array<Rollout>(groups.size());
  double total = 0.0;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    modes[m] = weighted_mean(rollouts, groups[m], scratch);
    total += modes[m].weight;
  }
  for (Rollout& mode : modes) mode.weight /= total;
  return modes;
}

std::vector<Vector2> mean_path(const Prediction& prediction, std::size_t steps) {
  std::vector<Vector2> mean(steps, Vector2::Zero());
  for (const Mode& mode : prediction.modes) {
    if (mode.path_m.size() < steps)
      throw invalid_argument("mean_path: steps = ", steps, ", but a mode has ", mode.path_m.size());
    for (std::size_t j = 0; j < steps; ++j) mean[j] += mode.weight * mode.path_m[j];
  }
  return mean;
}

}  // namespace sila
