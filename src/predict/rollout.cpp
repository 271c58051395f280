#include "sila/predict/rollout.hpp"

#include <algorithm>
#include <cmath>

#include "sila/core/kinematics.hpp"

namespace sila {
namespace {

/// A path under way.
struct Branch {
  Rollout rollout;
  Vector2 position, velocity;          ///< of the particle that follows the field [widths], [widths/s]
  Vector2 own_position, own_velocity;  ///< of the particle with its own speed [m], [m/s], world frame
  Matrix2 covariance = Matrix2::Zero();
  FlowLinearisation here;  ///< what the field that it follows says at `position`
  bool off_map = false;    ///< left the last field: keeps its velocity
};

struct Successor {
  int transition = 0;
  double probability = 0.0;
};

/// Transitions that follow in the graph and know the place; their probabilities sum to 1.
std::vector<Successor> successors(const FieldMap& map, int transition, const Vector2& position, double support_ratio) {
  std::vector<Successor> list;
  double total = 0.0;
  for (const int next : map.leaving(map.field(transition).to)) {
    const FieldMap::Field& field = map.field(next);
    if (next == transition) continue;
    if (field.posterior.predict_flow(position).variance >= support_ratio * field.signal_variance) continue;
    list.push_back({next, field.probability});
    total += field.probability;
  }
  for (Successor& successor : list) successor.probability /= total;
  return list;
}

class Roller {
 public:
  Roller(const FieldMap& map, const CurbTrajectory& observed, double interval_s, const PredictConfig& config)
      : map_(map), config_(config), frame_(observed.frame), dt_(interval_s), own_speed_mps_(mean_speed_mps(observed)) {}

  void advance(Branch& branch) const {
    const FieldMap::Field& field = map_.field(branch.rollout.transitions.back());
    if (!branch.off_map) branch.velocity = branch.here.flow.mean;
    spread(branch, field);
    branch.position += dt_ * branch.velocity;
    advance_own(branch, field);
    look(branch);
    branch.rollout.path.push_back(branch.position);
    branch.rollout.own_path.push_back(to_curb(frame_, branch.own_position));
    branch.rollout.covariances.push_back(branch.covariance);
  }

  /// Evaluates the field that the branch follows once, where it is.
  void look(Branch& branch) const {
    branch.here = map_.field(branch.rollout.transitions.back()).posterior.linearise_flow(branch.position);
  }

  /// True where the branch has left the field that it follows.
  bool has_left(const Branch& branch) const {
    if (branch.off_map) return false;
    const FieldMap::Field& field = map_.field(branch.rollout.transitions.back());
    return branch.here.flow.variance > config_.leave_ratio * field.signal_variance;
  }

  /// The branches that go on from here: one a successor, or the branch itself, off the map.
  std::vector<Branch> split(Branch branch, bool may_branch) const {
    std::vector<Successor> next;
    if (config_.chaining)
      next = successors(map_, branch.rollout.transitions.back(), branch.position, config_.support_ratio);
    if (next.empty()) {
      branch.off_map = true;
      return {std::move(branch)};
    }
    if (!may_branch) {
      const auto likeliest = std::max_element(
          next.begin(), next.end(), [](const auto& a, const auto& b) { return a.probability < b.probability; });
      next = {{likeliest->transition, 1.0}};
    }
    std::vector<Branch> branches(next.size(), branch);
    for (std::size_t k = 0; k < next.size(); ++k) {
      branches[k].rollout.weight *= next[k].probability;
      branches[k].rollout.chain_probability *= next[k].probability;
      branches[k].rollout.transitions.push_back(next[k].transition);
      look(branches[k]);
    }
    return branches;
  }

 private:
  void spread(Branch& branch, const FieldMap::Field& field) const {
    // A deviation from the field lasts for a while, so it adds up like noise of that correlation time, not like white
    // noise.
    const double lasting_s = std::min(2.0 * config_.noise_correlation_s,
                                      dt_ * (2.0 * static_cast<double>(branch.rollout.path.size()) + 1.0));
    Matrix2 step = Matrix2::Identity();
    if (!branch.off_map) step += dt_ * branch.here.jacobian;
    const Matrix2 grown = step * branch.covariance * step.transpose();
    branch.covariance = 0.5 * (grown + grown.transpose()) +
                        (branch.here.flow.variance + field.noise_variance) * lasting_s * dt_ * Matrix2::Identity();
  }

  void advance_own(Branch& branch, const FieldMap::Field& field) const {
    if (!branch.off_map) {
      const Vector2 flow =
          velocity_to_world(frame_, field.posterior.predict_flow(to_curb(frame_, branch.own_position)).mean);
      const double length = flow.norm();
      const double share = std::min(1.0, dt_ / config_.own_speed_relaxation_s);
      if (length > 1e-9) branch.own_velocity += share * (flow * (own_speed_mps_ / length) - branch.own_velocity);
    }
    branch.own_position += dt_ * branch.own_velocity;
  }

  const FieldMap& map_;
  const PredictConfig& config_;
  const CurbFrame& frame_;
  double dt_;
  double own_speed_mps_;
};

std::vector<Branch> start(const Candidates& candidates, const CurbTrajectory& observed) {
  std::vector<Branch> branches;
  for (const Candidate& candidate : candidates.list) {
    Branch branch;
    branch.rollout.weight = std::exp(candidate.score - candidates.list.front().score);
    branch.rollout.origin = candidate;
    branch.rollout.transitions.push_back(candidate.transition);
    branch.position = observed.positions.back();
    branch.velocity = observed.velocities.back();
    branch.own_position = to_world(observed.frame, branch.position);
    branch.own_velocity = velocity_to_world(observed.frame, branch.velocity);
    branches.push_back(std::move(branch));
  }
  return branches;
}

/// Light branches go, then those beyond the limit.
void prune(std::vector<Branch>& branches, const PredictConfig& config) {
  std::stable_sort(branches.begin(), branches.end(),
                   [](const Branch& a, const Branch& b) { return a.rollout.weight > b.rollout.weight; });
  const double least = config.min_relative_weight * branches.front().rollout.weight;
  std::erase_if(branches, [&](const Branch& branch) { return branch.rollout.weight < least; });
  if (branches.size() > static_cast<std::size_t>(config.max_branches)) {
    branches.erase(branches.begin() + config.max_branches, branches.end());
  }
}

}  // namespace

std::vector<Rollout> roll_out(const FieldMap& map, const Candidates& candidates, const CurbTrajectory& observed,
                              int steps, double interval_s, const PredictConfig& config) {
  const Roller roller(map, observed, interval_s, config);
  const int branching_steps = static_cast<int>(std::lround(config.mode_horizon_s / interval_s));
  std::vector<Branch> branches = start(candidates, observed);
  for (Branch& branch : branches) roller.look(branch);
  for (int step = 0; step < steps; ++step) {
    std::vector<Branch> next;
    bool split = false;
    for (Branch& branch : branches) {
      if (step > 0 && roller.has_left(branch)) {
        std::vector<Branch> parts = roller.split(std::move(branch), step < branching_steps);
        split = split || parts.size() > 1;
        std::move(parts.begin(), parts.end(), std::back_inserter(next));
      } else {
        next.push_back(std::move(branch));
      }
    }
    if (split) prune(next, config);
    for (Branch& branch : next) roller.advance(branch);
    branches = std::move(next);
  }
  std::vector<Rollout> rollouts;
  for (Branch& branch : branches) rollouts.push_back(std::move(branch.rollout));
  return rollouts;
}

}  // namespace sila
