#include "sila/predict/modes.hpp"

#include <algorithm>
#include <cmath>

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

bool heavier(const Rollout& a, const Rollout& b) {
  return a.weight > b.weight;
}

}  // namespace

std::vector<Rollout> merge_rollouts(std::vector<Rollout> rollouts, const CurbFrame& frame, int decision_steps,
                                    const PredictConfig& config) {
  if (rollouts.empty()) return {};
  std::stable_sort(rollouts.begin(), rollouts.end(), heavier);
  const Matrix2 matrix = world_from_curb(frame);
  const std::size_t steps =
      std::clamp<std::size_t>(static_cast<std::size_t>(decision_steps), 1, rollouts.front().path.size());
  std::vector<std::vector<const Rollout*>> groups;  // the first member, the heaviest, speaks for its group
  for (const Rollout& rollout : rollouts) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& members) {
      return mean_distance_m(*members.front(), rollout, matrix, steps) < config.merge_radius_m;
    });
    if (group == groups.end())
      groups.push_back({&rollout});
    else
      group->push_back(&rollout);
  }
  std::vector<Rollout> modes;
  for (const auto& members : groups) modes.push_back(weighted_mean(members));
  std::stable_sort(modes.begin(), modes.end(), heavier);
  if (modes.size() > static_cast<std::size_t>(config.max_modes))
    modes.erase(modes.begin() + config.max_modes, modes.end());
  double total = 0.0;
  for (const Rollout& mode : modes) total += mode.weight;
  for (Rollout& mode : modes) mode.weight /= total;
  return modes;
}

}  // namespace sila
