#include "predict/rollout.hpp"

#include <algorithm>
#include <cmath>

#include "sila/core/sampling.hpp"

namespace sila {
namespace {

/// One step of a path, and the one before it: paths that branch share their common steps.
struct Step {
  Vector2 position;  ///< [curb units]
  Matrix2 covariance;
  const Step* before = nullptr;
};

/// A transition that a path follows, and the one before it.
struct Link {
  int transition = 0;
  const Link* before = nullptr;
};

/// A path that is not complete.
struct Branch {
  double weight = 0.0, chain_probability = 1.0;
  Candidate origin;
  const Link* link = nullptr;
  const Step* step = nullptr;
  Vector2 deviation = Vector2::Zero();  ///< of the person from the field, decayed [curb units/s]
  Vector2 position, velocity;           ///< [curb units], [curb units/s]
  Matrix2 covariance = Matrix2::Zero();
  FieldLinearisation here;   ///< of the field that it follows, at `position`
  bool left_fields = false;  ///< left the last field: keeps its velocity; covariances still grow by that field
  std::size_t number = 0;    ///< breaks ties
};

struct Successor {
  int transition = 0;
  double probability = 0.0;
};

/// The transitions that follow in the graph and whose fields cover `position`; their probabilities sum to 1. If the
/// path may not branch, the most likely of them alone.
std::span<const Successor> successors(const FlowFieldIndex& fields, int transition, const Vector2& position,
                                      bool may_branch, double support_ratio, Scratch& scratch) {
  const std::span<const int> leaving = fields.leaving(fields.field(transition).to);
  const auto list = scratch.array<Successor>(leaving.size());
  std::size_t count = 0;
  double total = 0.0;
  for (const int next : leaving) {
    const FlowFieldIndex::Field& field = fields.field(next);
    if (next == transition) continue;
    if (field.posterior.unexplained_share(field.posterior.predict(position)) >= support_ratio) continue;
    list[count++] = {next, field.probability};
    total += field.probability;
  }
  const auto known = list.first(count);
  for (Successor& successor : known) successor.probability /= total;
  if (may_branch || count < 2) return known;
  std::iter_swap(known.begin(), std::ranges::max_element(known, {}, &Successor::probability));
  known.front().probability = 1.0;
  return known.first(1);
}

/// Advances and splits the branches of one prediction.
class Roller {
 public:
  Roller(const FlowFieldIndex& fields, double interval_s, bool with_covariances, const PredictConfig& config,
         Scratch& scratch)
      : fields_(fields), config_(config), dt_s_(interval_s), with_covariances_(with_covariances), scratch_(scratch) {}

  std::span<Branch> start(const Candidates& candidates, const CurbTrajectory& observed) const {
    const auto branches = scratch_.array<Branch>(candidates.list.size());
    for (std::size_t k = 0; k < branches.size(); ++k) {
      const Candidate& candidate = candidates.list[k];
      Branch& branch = branches[k];
      branch.weight = std::exp(candidate.score - candidates.list.front().score);
      branch.origin = candidate;
      branch.position = observed.positions.back();
      branch.velocity = observed.velocities.back();
      follow(branch, candidate.transition);
      if (config_.own_deviation) branch.deviation = branch.velocity - branch.here.flow.mean;
    }
    return branches;
  }

  void advance(Branch& branch, int steps_before) const {
    const FlowFieldIndex::Field& field = fields_.field(branch.link->transition);
    if (!branch.left_fields) branch.velocity = branch.here.flow.mean;
    if (!branch.left_fields && config_.own_deviation) {
      branch.velocity += branch.deviation;
      branch.deviation *= std::exp(-dt_s_ / config_.noise_correlation_s);
    }
    if (with_covariances_) spread(branch, field, steps_before);
    branch.position += dt_s_ * branch.velocity;
    if (!branch.left_fields || with_covariances_) evaluate_field(branch);
    Step& step = scratch_.array<Step>(1).front();
    step = {branch.position, branch.covariance, branch.step};
    branch.step = &step;
  }

  /// True where the branch has left the field that it follows.
  bool has_left(const Branch& branch) const {
    if (branch.left_fields) return false;
    const FlowPosterior& posterior = fields_.field(branch.link->transition).posterior;
    return posterior.unexplained_share(branch.here.flow) > config_.leave_ratio;
  }

  /// Replaces each branch that has left its field: by one branch for each successor, or by itself, without a field.
  std::span<Branch> split(std::span<const Branch> branches, bool may_branch) const {
    const auto nexts = scratch_.array<std::span<const Successor>>(branches.size());
    std::size_t most = branches.size();
    for (std::size_t b = 0; b < branches.size(); ++b) {
      nexts[b] = {};
      if (!has_left(branches[b])) continue;
      nexts[b] = successors(fields_, branches[b].link->transition, branches[b].position, may_branch,
                            config_.support_ratio, scratch_);
      most += nexts[b].size();
    }
    const auto list = scratch_.array<Branch>(most);
    std::size_t count = 0;
    for (std::size_t b = 0; b < branches.size(); ++b) {
      for (const Successor& successor : nexts[b]) {
        Branch& part = list[count++] = branches[b];
        part.weight *= successor.probability;
        part.chain_probability *= successor.probability;
        follow(part, successor.transition);
      }
      if (!nexts[b].empty()) continue;
      Branch& same = list[count++] = branches[b];
      same.left_fields |= has_left(same);
    }
    return list.first(count);
  }

  Rollout finished(const Branch& branch, std::size_t steps) const {
    const auto path = scratch_.array<Vector2>(steps);
    const auto covariances = scratch_.array<Matrix2>(with_covariances_ ? steps : 0);
    const Step* step = branch.step;
    for (std::size_t j = steps; j-- > 0; step = step->before) {
      path[j] = step->position;
      if (with_covariances_) covariances[j] = step->covariance;
    }
    std::size_t links = 0;
    for (const Link* link = branch.link; link; link = link->before) ++links;
    const auto transitions = scratch_.array<int>(links);
    for (const Link* link = branch.link; link; link = link->before) transitions[--links] = link->transition;
    return {branch.weight, path, covariances, transitions, branch.origin, branch.chain_probability};
  }

 private:
  void follow(Branch& branch, int transition) const {
    Link& link = scratch_.array<Link>(1).front();
    link = {transition, branch.link};
    branch.link = &link;
    evaluate_field(branch);
  }

  /// Evaluates the field that the branch follows once, at the current position.
  void evaluate_field(Branch& branch) const {
    const FlowPosterior& posterior = fields_.field(branch.link->transition).posterior;
    if (with_covariances_)
      branch.here = posterior.linearise(branch.position);
    else
      branch.here.flow = posterior.predict(branch.position);
  }

  /// The covariance after one more step.
  void spread(Branch& branch, const FlowFieldIndex::Field& field, int steps_before) const {
    Matrix2 step = Matrix2::Identity();
    if (!branch.left_fields) step += dt_s_ * branch.here.jacobian;
    const Matrix2 grown = step * branch.covariance * step.transpose();
    const Vector2 variance = branch.here.flow.variance + field.posterior.noise_variance();
    const Matrix2 added = (variance * spreading_time_s(steps_before) * dt_s_).asDiagonal();
    branch.covariance = 0.5 * (grown + grown.transpose()) + added;
  }

  /// The time that, times the variance of the velocity, gives the growth of the variance of the position per second.
  /// Deviations from the field are correlated in time, so errors add up as for noise of that correlation time, not as
  /// for white noise. If the deviation at the beginning is known (own_deviation), only its later change counts.
  double spreading_time_s(int steps_before) const {
    const double correlation_s = config_.noise_correlation_s;
    if (!config_.own_deviation) return std::min(2.0 * correlation_s, dt_s_ * (2.0 * steps_before + 1.0));
    const double gained = 1.0 - std::exp(-dt_s_ * (steps_before + 0.5) / correlation_s);
    return 2.0 * correlation_s * gained * gained;
  }

  const FlowFieldIndex& fields_;
  const PredictConfig& config_;
  double dt_s_;
  bool with_covariances_;
  Scratch& scratch_;
};

/// Removes the lightest branches: those beyond the limit, and those below the least weight.
std::span<Branch> prune(std::span<Branch> branches, const PredictConfig& config) {
  for (std::size_t b = 0; b < branches.size(); ++b) branches[b].number = b;
  std::ranges::sort(branches, {}, [](const Branch& branch) { return std::pair(-branch.weight, branch.number); });
  const double least = config.min_relative_weight * branches.front().weight;
  std::size_t kept = std::min(branches.size(), static_cast<std::size_t>(config.max_branches));
  while (branches[kept - 1].weight < least) --kept;
  return branches.first(kept);
}

}  // namespace

std::span<Rollout> roll_out(const FlowFieldIndex& fields, const Candidates& candidates, const CurbTrajectory& observed,
                            int steps, double interval_s, bool with_covariances, const PredictConfig& config,
                            Scratch& scratch) {
  const Roller roller(fields, interval_s, with_covariances, config, scratch);
  const int branching_steps = steps_in(config.mode_horizon_s, interval_s);
  std::span<Branch> branches = roller.start(candidates, observed);
  for (int step = 0; step < steps; ++step) {
    if (step > 0 && std::any_of(branches.begin(), branches.end(), [&](const auto& b) { return roller.has_left(b); })) {
      const std::size_t before = branches.size();
      branches = roller.split(branches, step < branching_steps);
      if (branches.size() > before) branches = prune(branches, config);
    }
    for (Branch& branch : branches) roller.advance(branch, step);
  }
  const auto rollouts = scratch.array<Rollout>(branches.size());
  for (std::size_t b = 0; b < branches.size(); ++b)
    rollouts[b] = roller.finished(branches[b], static_cast<std::size_t>(steps));
  return rollouts;
}

}  // namespace sila
