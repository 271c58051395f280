#include "refine/error_statistics.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/kinematics.hpp"
#include "model/parts.hpp"
#include "refine/prepared_model.hpp"
#include "refine/regions.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

/// Maximum weight of all other sites together in a cell of a site's nonconformity scores [windows].
constexpr double kMostOtherWindows = 20.0;
/// Maximum weight of the prior of a model at a trained site [windows].
constexpr double kMostPriorWindows = 200.0;

/// Along and across the predicted way. Without a way, the square of the error has equal parts in both directions, so
/// that the axes of the world do not matter.
Vector2 oriented(const Vector2& way, const Vector2& error) {
  const double length = way.norm();
  if (length < 1e-9) return Vector2::Constant(std::sqrt(0.5) * error.norm());
  return Vector2(way.dot(error), cross(way, error)) / length;
}

/// Scores under a density that was fitted to fewer windows count less, because that density still changes.
constexpr double kWindowsToKnowDensity = 500.0;

/// The errors and features of one window.
struct Example {
  PersonClass person;
  double raw_novelty = 1.0;
  bool fitted = false;  ///< predicted by a model with error statistics of this site
  SlowErrors slow_errors;
  ScaleFeatures scale, scale_place_free;
  std::vector<Features> features;                      ///< of each step
  std::vector<Vector2> truths_mps;                     ///< true mean velocities
  std::vector<Vector2> stacked_mps;                    ///< stacked ones
  std::vector<Vector2> errors_m, errors_place_free_m;  ///< along and across the predicted ways
  std::vector<double> nonconformities;
  MotionInput motion;
  Corrections corrections;
  ChangeWindow change;
  PrequentialError path;
};

/// Mean displacement error of each choice of a person who hardly moves.
SlowErrors slow_errors_of(const Example& example, const Stacking& stacking, double interval_s) {
  SlowErrors errors{example.features.empty() ? 0.0 : 1.0, {}};
  for (std::size_t j = 0; j < example.features.size(); ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    const Vector2 stacked = stacking.stacked_mps(example.features[j], j, example.person);
    const Vector2 constant = example.features[j].col(kConstantVelocityFeature);
    for (std::size_t c = 0; c < errors.errors_m.size(); ++c) {
      const Vector2 chosen = kSlowChoices[c].constant_velocity * constant + kSlowChoices[c].stacked * stacked;
      errors.errors_m[c] +=
          seconds * (example.truths_mps[j] - chosen).norm() / static_cast<double>(example.features.size());
    }
  }
  return errors;
}

/// Zero unless the window is whole, reaches the horizon and is of a person who moves.
PrequentialError path_error(const Prediction& prediction, const Window& window, const PersonClass& person, int steps,
                            double interval_s) {
  const auto count = static_cast<std::size_t>(steps);
  const bool moving = (window.past_m.back() - window.past_m.front()).norm() >= kMoving_m;
  if (person.observed != 0 || window.future_m.size() < count || !moving) return {};
  const std::vector<Vector2> model_m = mean_path(prediction, count);
  const std::vector<Vector2> constant_m = constant_velocity(window.past_m, steps, interval_s);
  PrequentialError error{1, 0.0, 0.0};
  for (std::size_t j = 0; j < count; ++j) {
    error.model_m += (model_m[j] - window.future_m[j]).norm() / steps;
    error.constant_m += (constant_m[j] - window.future_m[j]).norm() / steps;
  }
  return error;
}

Example example_of(const PreparedModel& model, const Window& window, int steps, Workspace& workspace) {
  workspace.scratch.reset();
  const double interval_s = model.interval_s();
  const MergedRollouts merged = model.merged_rollouts(window.observed, steps, workspace.scratch);
  const Prediction& prediction = model.predict(window.observed, merged, workspace);
  const Stacking& stacking = model.stacking(merged.seen.site);
  const ObservedFeatures& seen = merged.seen;
  Example example;
  example.person = seen.person;
  example.raw_novelty = merged.raw_novelty;
  example.fitted = seen.site && stacking.fitted();
  example.path = path_error(prediction, window, seen.person, steps, interval_s);
  const std::size_t last = stacking.fitted() ? stacking.last_step() : static_cast<std::size_t>(steps) - 1;
  const double horizon_s = static_cast<double>(last + 1) * interval_s;
  const Vector2 to_horizon = stacking.velocity_mps(stacked_features(seen, seen.residuals, horizon_s), last, seen);
  example.corrections = stacking.corrections(window.observed, seen, to_horizon);
  for (std::size_t j = 0; j < std::min(window.future_m.size(), static_cast<std::size_t>(steps)); ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    const Vector2 truth = window.future_m[j] - prediction.start_m;
    example.features.push_back(stacked_features(seen, seen.residuals, seconds));
    example.truths_mps.push_back(truth / seconds);
    example.stacked_mps.push_back(stacking.velocity_mps(example.features.back(), j, seen));
    const Vector2 way = seconds * (example.stacked_mps.back() + example.corrections.total.at(seconds));
    const Vector2 place_free_way = seconds * place_free_mps(seen, seconds);
    example.errors_m.push_back(oriented(way, truth - way));
    example.errors_place_free_m.push_back(oriented(place_free_way, truth - place_free_way));
    example.nonconformities.push_back(nonconformity(prediction, j, window.future_m[j]));
  }
  const PastVelocities past_mps = seen.kinematics.leftCols<4>();
  example.motion = motion_input(past_mps, window.observed.companions_mps);
  example.scale = scale_features(past_mps, to_horizon, seen.residuals.effective_samples);
  example.scale_place_free = scale_features(past_mps, place_free_mps(seen, horizon_s), 0.0);
  example.change = {hazard_features(past_mps, to_horizon, mean_speed_mps(window.observed), window.observed.still_s,
                                    position_at_corner_m(window.observed)),
                    change_step(motion_state(seen.person.speed), window.past_m, window.future_m, interval_s),
                    example.features.size()};
  if (seen.person.slow) example.slow_errors = slow_errors_of(example, stacking, interval_s);
  return example;
}

/// Precision of a true mean velocity, given its error. A large error is more probable under a wide component, and
/// counts less.
double precision(const ErrorDensity& density, std::size_t step, const ErrorScale& scale, const Vector2& error_m,
                 double seconds) {
  const auto shares = density.responsibilities(step, scale, error_m);
  double sum = 0.0;
  for (std::size_t c = 0; c < shares.size(); ++c)
    sum += shares[c] * seconds * seconds / density.variances_m2(c, step, scale).mean();
  return sum;
}

/// The errors of constant velocity in a window.
KnotErrors constant_errors(const Example& example) {
  std::vector<Vector2> errors_mps;
  for (std::size_t j = 0; j < example.features.size(); ++j)
    errors_mps.push_back(example.truths_mps[j] - example.features[j].col(kConstantVelocityFeature));
  return knot_errors(errors_mps);
}

/// Statistics of the path: only from windows that were observed whole.
void add_path(ErrorStatistics& error_statistics, const Example& example, const CurbTrajectory& observed,
              const Stacking& stacking) {
  const ErrorDensity& walking = stacking.density(kWalking, true);
  if (example.person.slow) add_sums(error_statistics.slow[*example.person.slow], example.slow_errors);
  const bool whole = example.features.size() == static_cast<std::size_t>(error_statistics.steps);
  if (example.person.walks() && whole)
    add_window(error_statistics.global_motion, example.motion, constant_errors(example));
  if (example.corrections.apply && whole)
    stacking.add_window(error_statistics, observed, example.corrections, example.truths_mps, example.stacked_mps);
  if (example.fitted) error_statistics.novelties[static_cast<std::size_t>(novelty_bin(example.raw_novelty))] += 1.0;
  const ErrorScale scale = walking.scale(example.scale);
  for (std::size_t j = 0; j < example.features.size(); ++j) {
    const std::size_t cell = j * kSpeedClasses + static_cast<std::size_t>(example.person.speed);
    const double seconds = static_cast<double>(j + 1) * error_statistics.interval_s;
    add_examples(error_statistics.stacking[cell], example.features[j].transpose(), example.truths_mps[j],
                 precision(walking, j, scale, example.errors_m[j], seconds));
  }
}

/// Adds one window to all statistics. `stacking`: that which predicted it.
void add(ErrorStatistics& error_statistics, const Example& example, const CurbTrajectory& observed,
         const Stacking& stacking) {
  if (example.person.observed == 0) add_path(error_statistics, example, observed, stacking);
  const ErrorDensity& of_whole = stacking.density(motion_state(example.person.speed), true);
  const double known = std::min(1.0, of_whole.windows() / kWindowsToKnowDensity);
  for (std::size_t j = 0; example.fitted && j < example.features.size(); ++j)
    error_statistics.scores[j * kScoreClasses + example.person.score()]
                           [static_cast<std::size_t>(score_bin(example.nonconformities[j]))] += known;
  const std::size_t number = example.person.density();
  stacking.density(number, true).add_errors(error_statistics.density[number], example.scale, example.errors_m);
  stacking.density(number, false)
      .add_errors(error_statistics.density_place_free[number], example.scale_place_free, example.errors_place_free_m);
}

}  // namespace

GatheredErrors gather_errors(const Predictor& predictor, std::span<const Window> windows) {
  const PreparedModel& model = prepared_in(predictor);
  const int steps = steps_in(model.config().horizon_s, model.interval_s());
  std::vector<Example> each(windows.size());
  tbb::enumerable_thread_specific<Workspace> workspaces;
  tbb::parallel_for(std::size_t{0}, windows.size(),
                    [&](std::size_t i) { each[i] = example_of(model, windows[i], steps, workspaces.local()); });
  GatheredErrors sum{zero_error_statistics(steps, model.interval_s(), model.config().observe_s), {}};
  if (windows.empty()) return sum;
  const Stacking& known = model.stacking(model.fields().site(windows.front().observed.frame));
  const Stacking unfitted(sum.statistics, model.config());
  const Stacking& stacking = known.fitted() ? known : unfitted;
  std::array<std::vector<ChangeWindow>, kMotionStates> changes;
  // In the order of the windows, so that rounding does not depend on the threads.
  for (std::size_t i = 0; i < windows.size(); ++i) {
    add(sum.statistics, each[i], windows[i].observed, stacking);
    sum.path += each[i].path;
    if (each[i].person.observed == 0) changes[motion_state(each[i].person.speed)].push_back(each[i].change);
  }
  for (std::size_t state = 0; state < kMotionStates; ++state)
    sum.statistics.changes[state] = stacking.change(state).moments_of(changes[state]);
  return sum;
}

ErrorStatistics pooled_error_statistics(const Model& model) {
  ErrorStatistics sum = model.refinement.prior;
  for (const ErrorStatistics& statistics : model.refinement.error_statistics)
    sum = add_error_statistics(sum, statistics);
  if (sum.empty()) return sum;
  ErrorStatistics zero = zero_error_statistics(sum.steps, sum.interval_s, sum.observe_s);
  sum.stacking = std::move(zero.stacking);
  sum.density = std::move(zero.density);
  sum.motion = std::move(zero.motion);
  sum.motion_share = std::move(zero.motion_share);
  forget_positions(sum);
  return sum;
}

ErrorStatistics shrunk_error_statistics(const Model& model, std::size_t site) {
  const std::vector<ErrorStatistics>& sites = model.refinement.error_statistics;
  ErrorStatistics own = entry_of(sites, site);
  for (std::size_t cell = 0; cell < own.scores.size(); ++cell) {
    std::vector<double> others(kScoreBins, 0.0);
    for (std::size_t s = 0; s < sites.size(); ++s) {
      if (s != site && !sites[s].empty()) add_sums(others, sites[s].scores[cell]);
    }
    const double windows = std::accumulate(others.begin(), others.end(), 0.0);
    const double share = std::min(1.0, kMostOtherWindows / windows);
    for (std::size_t bin = 0; bin < others.size(); ++bin) own.scores[cell][bin] += share * others[bin];
  }
  const ErrorStatistics& prior = model.refinement.prior;
  const double windows = windows_in(prior.density);
  if (!(windows > 0.0)) return own;
  return add_error_statistics(own, discounted(prior, std::min(1.0, kMostPriorWindows / windows)));
}

}  // namespace sila
