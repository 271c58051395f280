#include "sila/predict/modes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sila {
namespace {

double mean_distance_m(const Rollout& a, const Rollout& b, const Matrix2& world_from_curb, std::size_t steps) {
  double sum = 0.0;
  for (std::size_t j = 0; j < steps; ++j) sum += (world_from_curb * (a.path[j] - b.path[j])).norm();
  return sum / static_cast<double>(steps);
}

Rollout weighted_mean(const std::vector<const Rollout*>& members) {
  Rollout mean = *members.front();
  if (members.size() == 1) return mean;
  mean.weight = 0.0;
  for (const Rollout* member : members) mean.weight += member->weight;
  for (std::size_t j = 0; j < mean.path.size(); ++j) {
    mean.path[j].setZero(), mean.own_path[j].setZero(), mean.covariances[j].setZero();
    for (const Rollout* member : members) {
      const double share = member->weight / mean.weight;
      mean.path[j] += share * member->path[j];
      mean.own_path[j] += share * member->own_path[j];
    }
    for (const Rollout* member : members) {
      const Vector2 off = member->path[j] - mean.path[j];
      mean.covariances[j] += member->weight / mean.weight * (member->covariances[j] + off * off.transpose());
    }
  }
  return mean;
}

double weight_of(const std::vector<Rollout>& rollouts, const std::vector<std::size_t>& group) {
  double sum = 0.0;
  for (const std::size_t member : group) sum += rollouts[member].weight;
  return sum;
}

/// One pair of alternatives finds room beside the groups.
int most_groups(const PredictConfig& config) {
  constexpr int pair = 2;
  const bool alternatives = config.blend && config.alternatives >= pair && config.max_modes > pair;
  return alternatives ? config.max_modes - pair : config.max_modes;
}

}  // namespace

std::vector<std::vector<std::size_t>> group_rollouts(const std::vector<Rollout>& rollouts, const CurbFrame& frame,
                                                     int decision_steps, const PredictConfig& config) {
  std::vector<std::vector<std::size_t>> groups;  // the first member, the heaviest, speaks for its group
  if (rollouts.empty()) return groups;
  const Matrix2 matrix = world_from_curb(frame);
  const std::size_t steps =
      std::clamp<std::size_t>(static_cast<std::size_t>(decision_steps), 1, rollouts.front().path.size());
  std::vector<std::size_t> order(rollouts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return rollouts[a].weight > rollouts[b].weight; });
  for (const std::size_t index : order) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& members) {
      return mean_distance_m(rollouts[members.front()], rollouts[index], matrix, steps) < config.merge_radius_m;
    });
    if (group == groups.end())
      groups.push_back({index});
    else
      group->push_back(index);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [&](const auto& a, const auto& b) { return weight_of(rollouts, a) > weight_of(rollouts, b); });
  groups.resize(std::min(groups.size(), static_cast<std::size_t>(most_groups(config))));
  return groups;
}

std::vector<Rollout> merge_rollouts(const std::vector<Rollout>& rollouts,
                                    const std::vector<std::vector<std::size_t>>& groups) {
  std::vector<Rollout> modes;
  double total = 0.0;
  for (const auto& group : groups) {
    std::vector<const Rollout*> members;
    for (const std::size_t member : group) members.push_back(&rollouts[member]);
    total += modes.emplace_back(weighted_mean(members)).weight;
  }
  for (Rollout& mode : modes) mode.weight /= total;
  return modes;
}

}  // namespace sila
