#include "predict/predict.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

/// Constant velocity of the smoothed path, with errors that grow by kConstantVelocitySpread_mps.
void fill_constant_velocity(Mode& mode, const CurbTrajectory& observed, double interval_s) {
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  const Vector2 velocity_mps = mean_velocity_mps(observed, kConstantVelocityWindow_s);
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    const double spread = kConstantVelocitySpread_mps * seconds;
    mode.path_m[j] = start_m + seconds * velocity_mps;
    mode.covariances_m2[j] = Matrix2::Identity() * spread * spread;
  }
}

}  // namespace

void require_observed(const CurbTrajectory& observed, double interval_s) {
  validate(observed);
  for (std::size_t t = 1; t < observed.times_s.size(); ++t) {
    const double step_s = observed.times_s[t] - observed.times_s[t - 1];
    if (std::abs(step_s - interval_s) < 1e-3 * interval_s) continue;
    throw invalid_argument("predict: track '", observed.id, "' has an interval of ", step_s, " s at sample ", t,
                           ", the model's is ", interval_s, " s");
  }
}

RolloutSet roll_out_near(const FlowFieldIndex& fields, const CurbTrajectory& observed, int steps, double interval_s,
                         bool with_covariances, const PredictConfig& config, Scratch& scratch) {
  const int decision_steps = steps_in(config.mode_horizon_s, interval_s);
  RolloutSet set;
  set.site = fields.site(observed.frame);
  set.near = fields.near(observed, set.site, scratch);
  const Candidates candidates = find_candidates(fields, set.near, observed, config, scratch);
  set.rollouts = roll_out(fields, candidates, observed, std::max(steps, decision_steps), interval_s, with_covariances,
                          config, scratch);
  set.groups = group_rollouts(set.rollouts, observed.frame, decision_steps, config, scratch);
  set.raw_novelty = candidates.raw_novelty;
  return set;
}

Prediction& begin_prediction(const CurbTrajectory& observed, std::size_t steps, double interval_s,
                             Workspace& workspace) {
  Prediction& prediction = workspace.prediction;
  for (Mode& mode : prediction.modes) workspace.spare.push_back(std::move(mode));
  prediction.modes.clear();
  prediction.t0_s = observed.times_s.back();
  prediction.observed_s = observed.times_s.back() - observed.times_s.front();
  prediction.times_s.resize(steps);
  for (std::size_t j = 0; j < steps; ++j) prediction.times_s[j] = static_cast<double>(j + 1) * interval_s;
  return prediction;
}

Mode& add_mode(Workspace& workspace, double weight) {
  std::vector<Mode>& modes = workspace.prediction.modes;
  if (workspace.spare.empty()) {
    modes.emplace_back();
  } else {
    modes.push_back(std::move(workspace.spare.back()));
    workspace.spare.pop_back();
  }
  Mode& mode = modes.back();
  mode.weight = weight;
  mode.variant = VariantKind::expected;
  mode.sources.assign(1, modes.size() - 1);
  mode.primitives.clear();
  mode.primitives.reserve(32);  // reused modes keep their capacity
  mode.path_m.resize(workspace.prediction.times_s.size());
  mode.covariances_m2.resize(mode.path_m.size());
  return mode;
}

void visit_primitives(const FlowFieldIndex& fields, std::span<const int> transitions, std::vector<int>& visited) {
  for (const int index : transitions) {
    const FlowFieldIndex::Field& field = fields.field(index);
    if (visited.empty() || visited.back() != field.from) visited.push_back(field.from);
    if (visited.back() != field.to) visited.push_back(field.to);
  }
}

// Modes are few enough to be moved one by one, without memory.
void sort_by_weight(std::vector<Mode>& modes) {
  for (auto end = modes.begin(); end != modes.end(); ++end) {
    const auto target =
        std::upper_bound(modes.begin(), end, *end, [](const Mode& a, const Mode& b) { return a.weight > b.weight; });
    std::rotate(target, end, end + 1);
  }
}

void add_rollout_modes(const FlowFieldIndex& fields, std::span<const Rollout> rollouts, const CurbTrajectory& observed,
                       double interval_s, Workspace& workspace) {
  Prediction& prediction = workspace.prediction;
  prediction.fallback = rollouts.empty();
  const Matrix2 matrix = world_from_curb(observed.frame);
  for (const Rollout& rollout : rollouts) {  // the paper's mode: the roll-out itself
    Mode& mode = add_mode(workspace, rollout.weight);
    visit_primitives(fields, rollout.transitions, mode.primitives);
    for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
      mode.path_m[j] = to_world(observed.frame, rollout.path[j]);
      mode.covariances_m2[j] = matrix * rollout.covariances[j] * matrix.transpose();
    }
  }
  if (prediction.fallback) fill_constant_velocity(add_mode(workspace, 1.0), observed, interval_s);
}

Prediction predict_by_rollouts(const FlowFieldIndex& fields, const CurbTrajectory& observed, double interval_s,
                               const PredictConfig& config) {
  require_observed(observed, interval_s);
  Workspace workspace;
  const int steps = steps_in(config.horizon_s, interval_s);
  const RolloutSet set = roll_out_near(fields, observed, steps, interval_s, true, config, workspace.scratch);
  Prediction& prediction = begin_prediction(observed, static_cast<std::size_t>(steps), interval_s, workspace);
  prediction.novelty = set.raw_novelty;
  add_rollout_modes(fields, merge_rollouts(set.rollouts, set.groups, workspace.scratch), observed, interval_s,
                    workspace);
  return std::move(prediction);
}

}  // namespace sila
