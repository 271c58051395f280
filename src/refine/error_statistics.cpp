#include "sila/refine/error_statistics.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "sila/core/steps.hpp"

namespace sila {
namespace {

void add(RegressionMoments& moments, const Features& features, const Vector2& target, double weight) {
  moments.weight += weight;
  moments.features.noalias() += weight * features.transpose() * features;
  moments.products.noalias() += weight * features.transpose() * target;
}

/// The error in the frame of the predicted way.
void add(ErrorMoments& moments, const Vector2& way, const Vector2& error, double weight) {
  const double length = way.norm();
  const Vector2 along = length > 1e-9 ? Vector2(way / length) : Vector2(Vector2::UnitX());
  const double forward = along.dot(error);
  moments.weight += weight;
  moments.along_m2 += weight * forward * forward;
  moments.across_m2 += weight * (error.squaredNorm() - forward * forward);
}

double density(const Vector2& error, const Matrix2& covariance) {
  return std::exp(-0.5 * error.dot(covariance.inverse() * error)) / std::sqrt(covariance.determinant());
}

/// What all other sites together weigh in a cell of a site's nonconformity scores, at the most.
constexpr double kPriorWindows = 20.0;

struct ModeAtStep {
  Features features;
  Vector2 way = Vector2::Zero();  ///< predicted displacement [m]
  double weight = 0.0;
  double responsibility = 0.0;  ///< how likely this mode is the one that happened
};

/// What each mode says of one step, and how well that fits what happened.
std::vector<ModeAtStep> modes_at(const Predictor& predictor, const Window& window, const MergedRollouts& merged,
                                 const ObservedFeatures& seen, std::size_t step, const Vector2& truth) {
  std::vector<ModeAtStep> modes;
  const double seconds = static_cast<double>(step + 1) * predictor.interval_s();
  const Stacking& stacking = predictor.stacking(seen.site);
  double total = 0.0;
  for (std::size_t m = 0; m < merged.rollouts.size(); ++m) {
    const Rollout& rollout = merged.rollouts[m];
    ModeAtStep mode{map_features(seen, rollout, merged.residuals[m], window.observed, step, predictor.interval_s()),
                    {},
                    rollout.weight,
                    0.0};
    mode.way = seconds * stacking.velocity_mps(mode.features, step, seen);
    Vector2 variances = stacking.error_variance_m2(step, seen.speed, kMapFeatures);
    if (variances.isZero()) variances = Vector2::Constant(0.25 * seconds * seconds);
    mode.responsibility = mode.weight * density(truth - mode.way, oriented_covariance(mode.way, variances));
    total += mode.responsibility;
    modes.push_back(std::move(mode));
  }
  for (ModeAtStep& mode : modes) mode.responsibility = total > 1e-300 ? mode.responsibility / total : mode.weight;
  return modes;
}

/// What one window shows of one step.
struct Example {
  std::vector<ModeAtStep> modes;
  Features alone;  ///< features without a roll-out
  Vector2 alone_way = Vector2::Zero(), place_free_way = Vector2::Zero();
  Vector2 truth = Vector2::Zero();  ///< displacement from t0 [m]
  double nonconformity = 0.0;
};

struct WindowExamples {
  int speed = 0;
  double raw_novelty = 1.0;
  bool fitted = false;  ///< by a model that had learnt something
  std::optional<std::size_t> slow;
  SlowErrors slow_errors;  ///< of this window
  std::vector<Example> steps;
};

/// Mean displacement error of each choice of a person who hardly moves; the modes together are the stacked prediction.
SlowErrors slow_errors_of(const WindowExamples& window, const Stacking& stacking, double interval_s) {
  SlowErrors errors{window.steps.empty() ? 0.0 : 1.0, {}};
  for (std::size_t j = 0; j < window.steps.size(); ++j) {
    const Example& example = window.steps[j];
    const double seconds = static_cast<double>(j + 1) * interval_s;
    Vector2 stacked = Vector2::Zero();
    for (const ModeAtStep& mode : example.modes)
      stacked += mode.weight * seconds * stacking.stacked_mps(mode.features, j, window.speed);
    if (example.modes.empty()) stacked = seconds * stacking.stacked_mps(example.alone, j, window.speed);
    const Vector2 constant = seconds * example.alone.col(kConstantVelocityFeature);
    for (std::size_t c = 0; c < errors.errors_m.size(); ++c) {
      const Vector2 way = kSlowChoices[c].constant_velocity * constant + kSlowChoices[c].stacked * stacked;
      errors.errors_m[c] += (example.truth - way).norm() / static_cast<double>(window.steps.size());
    }
  }
  return errors;
}

WindowExamples examples_of(const Predictor& predictor, const Window& window, int steps, Workspace& workspace) {
  workspace.scratch.reset();
  const MergedRollouts merged = predictor.merged_rollouts(window.observed, steps, workspace.scratch);
  const Prediction& prediction = predictor.predict(window.observed, merged, workspace);
  const Stacking& stacking = predictor.stacking(merged.seen.site);
  // What other sites know would spoil the statistics of a new one: they begin as if it were the first.
  ObservedFeatures seen = merged.seen;
  if (!seen.site) seen.global_residual = {};
  WindowExamples examples{seen.speed, merged.raw_novelty, seen.site && stacking.fitted(), seen.slow, {}, {}};
  const Vector2 start_m = to_world(window.observed.frame, window.observed.positions.back());
  for (std::size_t j = 0; j < std::min(window.future_m.size(), static_cast<std::size_t>(steps)); ++j) {
    Example example;
    example.truth = window.future_m[j] - start_m;
    example.alone = alone_features(seen, seen.residuals, j, predictor.interval_s());
    example.alone_way =
        static_cast<double>(j + 1) * predictor.interval_s() * stacking.velocity_mps(example.alone, j, seen);
    example.place_free_way =
        static_cast<double>(j + 1) * predictor.interval_s() *
        stacking.velocity_mps(place_free_features(merged.seen, j, predictor.interval_s()), j, seen);
    example.modes = modes_at(predictor, window, merged, seen, j, example.truth);
    example.nonconformity = nonconformity(prediction, j, window.future_m[j]);
    examples.steps.push_back(std::move(example));
  }
  if (merged.seen.slow) examples.slow_errors = slow_errors_of(examples, stacking, predictor.interval_s());
  return examples;
}

void add(ErrorStatistics& error_statistics, const WindowExamples& window) {
  if (window.slow) error_statistics.slow[*window.slow] += window.slow_errors;
  if (window.fitted) error_statistics.novelties[static_cast<std::size_t>(novelty_bin(window.raw_novelty))] += 1.0;
  for (std::size_t j = 0; j < window.steps.size(); ++j) {
    const Example& example = window.steps[j];
    const std::size_t cell = j * kSpeedClasses + static_cast<std::size_t>(window.speed);
    const double seconds = static_cast<double>(j + 1) * error_statistics.interval_s;
    if (window.fitted) error_statistics.scores[cell][static_cast<std::size_t>(score_bin(example.nonconformity))] += 1.0;
    add(error_statistics.without_map[cell], example.alone, example.truth / seconds, 1.0);
    add(error_statistics.errors_without_map[cell], example.alone_way, example.truth - example.alone_way, 1.0);
    add(error_statistics.errors_place_free[cell], example.place_free_way, example.truth - example.place_free_way, 1.0);
    for (const ModeAtStep& mode : example.modes) {
      add(error_statistics.with_map[cell], mode.features, example.truth / seconds, mode.weight);
      add(error_statistics.errors_with_map[cell], mode.way, example.truth - mode.way, mode.responsibility);
    }
  }
}

}  // namespace

ErrorStatistics gather_error_statistics(const Predictor& predictor, std::span<const Window> windows) {
  const int steps = steps_in(predictor.config().horizon_s, predictor.interval_s());
  std::vector<WindowExamples> each(windows.size());
  tbb::enumerable_thread_specific<Workspace> workspaces;
  tbb::parallel_for(std::size_t{0}, windows.size(),
                    [&](std::size_t i) { each[i] = examples_of(predictor, windows[i], steps, workspaces.local()); });
  ErrorStatistics sum =
      zero_error_statistics(steps, predictor.interval_s());  // in the order of the windows, whatever the threads did
  for (const WindowExamples& examples : each) add(sum, examples);
  return sum;
}

ErrorStatistics pooled_error_statistics(const std::vector<Site>& sites, bool place_free) {
  ErrorStatistics sum;
  for (const Site& site : sites) accumulate(sum, site.error_statistics);
  if (!place_free || sum.empty()) return sum;
  ErrorStatistics free = zero_error_statistics(sum.steps, sum.interval_s);
  free.errors_place_free = std::move(sum.errors_place_free);
  free.scores = std::move(sum.scores);
  free.novelties = std::move(sum.novelties);
  free.slow = std::move(sum.slow);
  return free;
}

ErrorStatistics shrunk_error_statistics(const std::vector<Site>& sites, std::size_t site) {
  ErrorStatistics own = sites[site].error_statistics;
  for (std::size_t cell = 0; cell < own.scores.size(); ++cell) {
    std::vector<double> others(kScoreBins, 0.0);
    for (std::size_t s = 0; s < sites.size(); ++s) {
      if (s == site || sites[s].error_statistics.empty()) continue;
      std::ranges::transform(others, sites[s].error_statistics.scores[cell], others.begin(), std::plus<>{});
    }
    const double windows = std::accumulate(others.begin(), others.end(), 0.0);
    if (windows <= 0.0) continue;
    const double share = std::min(1.0, kPriorWindows / windows);
    for (std::size_t bin = 0; bin < others.size(); ++bin) own.scores[cell][bin] += share * others[bin];
  }
  return own;
}

}  // namespace sila
