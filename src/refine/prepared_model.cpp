#include "refine/prepared_model.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "refine/error_statistics.hpp"
#include "refine/mode_variants.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

Vector2 velocity_mps(const Stacking& stacking, const ObservedFeatures& seen, const ResidualPrediction& residuals,
                     std::size_t step, double interval_s) {
  const double seconds = static_cast<double>(step + 1) * interval_s;
  return seen.uses_residuals ? stacking.velocity_mps(stacked_features(seen, residuals, seconds), step, seen)
                             : place_free_mps(seen, seconds);
}

/// Fills the path of a mode; returns the scale of its errors.
ErrorScale fill_path(Mode& mode, const Stacking& stacking, const ObservedFeatures& seen,
                     const ResidualPrediction& residuals, const VelocityCorrection& correction, const Vector2& start_m,
                     double interval_s) {
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    mode.path_m[j] =
        start_m + seconds * (velocity_mps(stacking, seen, residuals, j, interval_s) + correction.at(seconds));
  }
  const ErrorDensity& density = stacking.density(seen.person.density(), seen.uses_residuals);
  return density.scale(scale_features(seen.kinematics.leftCols<4>(),
                                      velocity_mps(stacking, seen, residuals, stacking.last_step(), interval_s),
                                      seen.uses_residuals ? residuals.effective_samples : 0.0));
}

/// Transitions with which roll-outs of other modes begin, and no roll-out of this mode.
std::span<const int> rivals_of(const RolloutSet& set, std::size_t mode, Scratch& scratch) {
  const auto first_of = [&](std::size_t member) { return set.rollouts[member].origin.transition; };
  const RolloutGroup own = set.groups[mode];
  const auto rivals = scratch.array<int>(set.rollouts.size());
  std::size_t count = 0;
  for (std::size_t group = 0; group < set.groups.size(); ++group) {
    if (group == mode) continue;
    for (const std::size_t rival : set.groups[group]) {
      const bool shared =
          std::any_of(own.begin(), own.end(), [&](std::size_t member) { return first_of(member) == first_of(rival); });
      if (!shared) rivals[count++] = first_of(rival);
    }
  }
  return rivals.first(count);
}

/// Widens covariances that are smaller, in some direction, than that of the least error.
void widen_to_least_error(std::span<Mode> modes) {
  constexpr double least_m2 = kLeastError_m * kLeastError_m;
  for (Mode& mode : modes) {
    for (Matrix2& c : mode.covariances_m2) {
      const double smaller_m2 = 0.5 * c.trace() - std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1));
      if (smaller_m2 < least_m2) c.diagonal().array() += least_m2 - smaller_m2;
    }
  }
}

/// Makes the last mode part of an earlier one with the same path (roll-outs that no residual GP tells apart); whether
/// there is one.
bool join_last_mode(Workspace& workspace) {
  std::vector<Mode>& modes = workspace.prediction.modes;
  Mode& last = modes.back();
  const auto same = std::ranges::find(modes, last.path_m, &Mode::path_m);
  if (same == modes.end() - 1) return false;
  same->weight += last.weight;
  same->sources.push_back(last.sources.front());
  workspace.spare.push_back(std::move(last));
  modes.pop_back();
  return true;
}

/// Sets the position and the heading that outcomes refer to (sila/refine/outcomes.hpp).
void describe_person(Prediction& prediction, const CurbTrajectory& observed, const ObservedFeatures& seen) {
  prediction.standing = motion_state(seen.person.speed) == kStanding;
  prediction.start_m = to_world(observed.frame, observed.positions.back());
  const Vector2 velocity_mps = seen.kinematics.col(kConstantVelocityFeature);
  const double speed_mps = velocity_mps.norm();
  const bool still = prediction.standing || speed_mps < 1e-9;
  prediction.heading = still ? observed.frame.axis_1 : Vector2(velocity_mps / speed_mps);
  prediction.mirrored = cross(observed.frame.axis_1, observed.frame.axis_2) < 0.0;
}

/// Weights of the error components. For a standing person they depend on the probability of still standing at 3/4 of
/// the fitted horizon.
ComponentWeights component_weights(const Stacking& stacking, const ObservedFeatures& seen, const ErrorDensity& density,
                                   const ErrorScale& scale, const HazardFeatures& hazard, Scratch& scratch) {
  if (motion_state(seen.person.speed) != kStanding) return scale.weights;
  const std::size_t step = 3 * stacking.last_step() / 4;
  const std::span<double> started = scratch.array<double>(step + 1);
  stacking.change(kStanding).probabilities(hazard, started);
  return standing_weights(density, step, scale, 1.0 - started.back());
}

void add_regions(Prediction& prediction, const Calibration& calibration, std::size_t score_class) {
  prediction.regions.resize(kRegionProbabilities.size());
  for (std::size_t r = 0; r < kRegionProbabilities.size(); ++r) {
    Region& region = prediction.regions[r];
    region.probability = kRegionProbabilities[r];
    region.levels.resize(prediction.times_s.size());
    for (std::size_t j = 0; j < region.levels.size(); ++j) region.levels[j] = calibration.level(j, score_class, r);
  }
}

/// Whether the error components are modes of their own; else each mode has the variance of all of them.
bool has_wide_modes(const RefineConfig& config) {
  return config.stacking && config.max_modes >= kMixtureComponents;
}

/// The settings of the roll-outs: wide modes leave fewer of the modes to them.
PredictConfig rollout_config(const RefineConfig& config) {
  PredictConfig result = config;
  if (has_wide_modes(config)) result.max_modes -= kMixtureComponents - 1;
  return result;
}

}  // namespace

PreparedModel::PreparedModel(const Model& model, const RefineConfig& config, const Model* earlier,
                             const PreparedModel* of_earlier)
    : config_(config),
      rollout_config_(rollout_config(config)),
      interval_s_(model.settings.sample_interval_s),
      scaling_(model.settings.scaling),
      fields_(model, config, earlier, of_earlier ? &of_earlier->fields_ : nullptr),
      residuals_(model, earlier, of_earlier ? &of_earlier->residuals_ : nullptr),
      untrained_(fitted_to(pooled_error_statistics(model))) {
  validate_fields("predict", config);
  if (config.observe_s > untrained_.stacking.observe_s() + 1e-9)
    throw invalid_argument("predict.observe_s = ", config.observe_s, ", the model uses at most ",
                           untrained_.stacking.observe_s(), " s");
  by_site_.resize(model.sites.size(), fitted_to({}));
  tbb::parallel_for(std::size_t{0}, by_site_.size(),
                    [&](std::size_t site) { by_site_[site] = fitted_to(shrunk_error_statistics(model, site)); });
}

PreparedModel::Fitted PreparedModel::fitted_to(const ErrorStatistics& error_statistics) const {
  return {Stacking(error_statistics, config_), Calibration(config_.stacking ? error_statistics : ErrorStatistics{})};
}

RolloutSet PreparedModel::rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const {
  const bool with_covariances = !stacking(fields_.site(observed.frame)).fitted();
  return roll_out_near(fields_, observed, steps, interval_s_, with_covariances, rollout_config_, scratch);
}

ObservedFeatures PreparedModel::observe(const CurbTrajectory& observed, const RolloutSet& set, Scratch& scratch) const {
  const Stacking& stacking = fitted(set.site).stacking;
  ObservedFeatures seen;
  seen.kinematics = kinematic_features(observed);
  seen.person = person_class(observed, stacking.observe_s());
  seen.site = set.site;
  seen.fields_nearby = !set.near.empty();
  seen.uses_residuals = seen.site || !stacking.fitted();
  seen.global_motion = stacking.global_motion(seen, observed);
  seen.experts = predict_experts(residuals_, set.near, observed, scratch);
  seen.residuals = combine(residuals_, observed, seen.experts, {}, scratch);
  return seen;
}

MergedRollouts PreparedModel::merged_rollouts(const CurbTrajectory& observed, int steps, Scratch& scratch) const {
  const RolloutSet set = rollouts(observed, steps, scratch);
  const ObservedFeatures seen = observe(observed, set, scratch);
  const std::span<Rollout> modes = merge_rollouts(set.rollouts, set.groups, scratch);
  const auto residuals = scratch.array<ResidualPrediction>(modes.size());
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const std::span<const int> rivals = rivals_of(set, m, scratch);
    residuals[m] = rivals.empty() ? seen.residuals : combine(residuals_, observed, seen.experts, rivals, scratch);
  }
  return {modes, residuals, seen, set.raw_novelty};
}

const Prediction& PreparedModel::predict(const CurbTrajectory& observed, const MergedRollouts& merged,
                                         Workspace& workspace) const {
  const auto steps = static_cast<std::size_t>(steps_in(config_.horizon_s, interval_s_));
  const ObservedFeatures& seen = merged.seen;
  const auto& [stacking, calibration] = fitted(seen.site);
  Prediction& prediction = begin_prediction(observed, steps, interval_s_, workspace);
  describe_person(prediction, observed, seen);
  prediction.novelty = calibration.novelty(merged.raw_novelty);
  prediction.fallback = merged.rollouts.empty() || !seen.uses_residuals;
  if (!stacking.fitted()) {
    add_unfitted_modes(observed, merged, workspace);
    return prediction;
  }
  const Vector2 to_horizon = velocity_mps(stacking, seen, seen.residuals, stacking.last_step(), interval_s_);
  const VelocityCorrection correction = stacking.corrections(observed, seen, to_horizon).total;
  const HazardFeatures hazard = hazard_features(seen.kinematics.leftCols<4>(), to_horizon, mean_speed_mps(observed),
                                                observed.still_s, position_at_corner_m(observed));
  add_stacked_modes(merged, hazard, correction, workspace);
  sort_by_weight(prediction.modes);
  add_regions(prediction, calibration, seen.person.score());
  prediction.change_probabilities.resize(steps);
  stacking.change(motion_state(seen.person.speed)).probabilities(hazard, prediction.change_probabilities);
  return prediction;
}

void PreparedModel::add_unfitted_modes(const CurbTrajectory& observed, const MergedRollouts& merged,
                                       Workspace& workspace) const {
  Prediction& prediction = workspace.prediction;
  prediction.regions.clear();
  prediction.change_probabilities.clear();
  if (!prediction.fallback) {
    add_rollout_modes(fields_, merged.rollouts, observed, interval_s_, workspace);
    return widen_to_least_error(prediction.modes);
  }
  Mode& mode = add_mode(workspace, 1.0);
  const ObservedFeatures& seen = merged.seen;
  fill_path(mode, fitted(seen.site).stacking, seen, seen.residuals, {}, prediction.start_m, interval_s_);
  for (std::size_t j = 0; j < mode.covariances_m2.size(); ++j) {
    const double spread_m = kConstantVelocitySpread_mps * static_cast<double>(j + 1) * interval_s_;
    mode.covariances_m2[j] = Matrix2::Identity() * spread_m * spread_m;
  }
}

void PreparedModel::add_stacked_modes(const MergedRollouts& merged, const HazardFeatures& hazard,
                                      const VelocityCorrection& correction, Workspace& workspace) const {
  const bool fallback = workspace.prediction.fallback;
  const ObservedFeatures& seen = merged.seen;
  const Stacking& stacking = fitted(seen.site).stacking;
  const ErrorDensity& density = stacking.density(seen.person.density(), seen.uses_residuals);
  const Vector2 start_m = workspace.prediction.start_m;
  const bool wide = has_wide_modes(config_);
  const std::size_t count = fallback ? 1 : merged.rollouts.size();
  const auto scales = workspace.scratch.array<ErrorScale>(count);
  for (std::size_t m = 0; m < count; ++m) {
    Mode& mode = add_mode(workspace, fallback ? 1.0 : merged.rollouts[m].weight);
    mode.sources.assign(1, m);
    if (!fallback) visit_primitives(fields_, merged.rollouts[m].transitions, mode.primitives);
    const ResidualPrediction& residuals = fallback ? seen.residuals : merged.residuals[m];
    scales[m] = fill_path(mode, stacking, seen, residuals, correction, start_m, interval_s_);
    if (join_last_mode(workspace)) continue;
    fill_covariances(mode, density, wide ? std::optional<std::size_t>(0) : std::nullopt, scales[m], start_m);
  }
  sort_by_weight(workspace.prediction.modes);
  if (!wide) return;
  const ErrorScale& scale = scales[workspace.prediction.modes.front().sources.front()];
  const ComponentWeights weights = component_weights(stacking, seen, density, scale, hazard, workspace.scratch);
  for (Mode& mode : workspace.prediction.modes) mode.weight *= weights[0];
  if (!seen.person.hardly_moved()) add_variants(workspace, density, scale, start_m, config_);
  add_wide_modes(workspace, density, weights, scale, start_m);
}

}  // namespace sila
