#include "sila/predict/lessons.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "sila/core/steps.hpp"
#include "sila/model/fading.hpp"

namespace sila {
namespace {

Lessons empty_lessons(int steps, double interval_s) {
  Lessons lessons;
  lessons.steps = steps, lessons.classes = kSpeedClasses, lessons.interval_s = interval_s;
  const auto cells = static_cast<std::size_t>(steps * kSpeedClasses);
  const auto blank = [](int f) {
    return RegressionMoments{0.0, Eigen::MatrixXd::Zero(f, f), Eigen::VectorXd::Zero(f)};
  };
  lessons.with_map.assign(cells, blank(kMapFeatures));
  lessons.without_map.assign(cells, blank(kAloneFeatures));
  lessons.residuals_with_map.resize(cells);
  lessons.residuals_without_map.resize(cells);
  lessons.residuals_place_free.resize(cells);
  lessons.surprises.assign(cells, std::vector<double>(kSurpriseBins, 0.0));
  lessons.novelties.assign(kNoveltyBins, 0.0);
  return lessons;
}

void add(RegressionMoments& moments, const Features& features, const Vector2& target, double weight) {
  moments.weight += weight;
  moments.features.noalias() += weight * features.transpose() * features;
  moments.products.noalias() += weight * features.transpose() * target;
}

/// The error in the frame of the predicted way.
void add(ResidualMoments& moments, const Vector2& way, const Vector2& error, double weight) {
  const double length = way.norm();
  const Vector2 along = length > 1e-9 ? Vector2(way / length) : Vector2(Vector2::UnitX());
  const double forward = along.dot(error);
  moments.weight += weight;
  moments.along_m2 += weight * forward * forward;
  moments.across_m2 += weight * (error.squaredNorm() - forward * forward);
}

constexpr double kWindowsToKnowCovariance = 20.0;

double density(const Vector2& error, const Matrix2& covariance) {
  return std::exp(-0.5 * error.dot(covariance.inverse() * error)) / std::sqrt(covariance.determinant());
}

struct ModeAtStep {
  Features features;
  Vector2 way = Vector2::Zero();  ///< predicted displacement [m]
  double weight = 0.0;
  double responsibility = 0.0;  ///< how likely this mode is the one that happened
};

/// What each mode says of one step, and how well that fits what happened.
std::vector<ModeAtStep> modes_at(const Predictor& predictor, const Window& window, const Hypotheses& hypotheses,
                                 const Observation& seen, std::size_t step, const Vector2& truth) {
  std::vector<ModeAtStep> modes;
  const double seconds = static_cast<double>(step + 1) * predictor.interval_s();
  double total = 0.0;
  for (const Rollout& rollout : hypotheses.rollouts) {
    ModeAtStep mode{
        map_features(seen, rollout, window.observed, step, predictor.interval_s()), {}, rollout.weight, 0.0};
    mode.way = seconds * predictor.blend().velocity_mps(mode.features, step, seen.speed);
    Vector2 variances = predictor.blend().residual_m2(step, seen.speed, kMapFeatures);
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
  double surprise = 0.0;
};

struct WindowExamples {
  int speed = 0;
  double raw_novelty = 1.0;
  bool taught = false;  ///< by a model that had learnt something
  std::vector<Example> steps;
};

WindowExamples examples_of(const Predictor& predictor, const Window& window, int steps, Workspace& workspace) {
  workspace.scratch.reset();
  const Hypotheses hypotheses = predictor.hypotheses(window.observed, steps, workspace.scratch);
  const Prediction& prediction = predictor.predict(window.observed, hypotheses, workspace);
  WindowExamples examples{hypotheses.seen.speed, hypotheses.raw_novelty, predictor.blend().taught(), {}};
  const Vector2 start_m = to_world(window.observed.frame, window.observed.positions.back());
  for (std::size_t j = 0; j < std::min(window.future_m.size(), static_cast<std::size_t>(steps)); ++j) {
    Example example;
    example.truth = window.future_m[j] - start_m;
    example.alone = alone_features(hypotheses.seen, hypotheses.seen.outlooks, j, predictor.interval_s());
    example.alone_way = static_cast<double>(j + 1) * predictor.interval_s() *
                        predictor.blend().velocity_mps(example.alone, j, examples.speed);
    example.place_free_way = static_cast<double>(j + 1) * predictor.interval_s() *
                             predictor.blend().velocity_mps(
                                 place_free_features(hypotheses.seen, j, predictor.interval_s()), j, examples.speed);
    example.modes = modes_at(predictor, window, hypotheses, hypotheses.seen, j, example.truth);
    example.surprise = surprise(prediction, j, window.future_m[j]);
    examples.steps.push_back(std::move(example));
  }
  return examples;
}

void add(Lessons& lessons, const WindowExamples& window) {
  if (window.taught) lessons.novelties[static_cast<std::size_t>(novelty_bin(window.raw_novelty))] += 1.0;
  for (std::size_t j = 0; j < window.steps.size(); ++j) {
    const Example& example = window.steps[j];
    const std::size_t cell = j * kSpeedClasses + static_cast<std::size_t>(window.speed);
    const double seconds = static_cast<double>(j + 1) * lessons.interval_s;
    if (window.taught) lessons.surprises[cell][static_cast<std::size_t>(surprise_bin(example.surprise))] += 1.0;
    add(lessons.without_map[cell], example.alone, example.truth / seconds, 1.0);
    add(lessons.residuals_without_map[cell], example.alone_way, example.truth - example.alone_way, 1.0);
    add(lessons.residuals_place_free[cell], example.place_free_way, example.truth - example.place_free_way, 1.0);
    for (const ModeAtStep& mode : example.modes) {
      add(lessons.with_map[cell], mode.features, example.truth / seconds, mode.weight);
      add(lessons.residuals_with_map[cell], mode.way, example.truth - mode.way, mode.responsibility);
    }
  }
}

template <class Moments>
void accumulate_cells(std::vector<Moments>& sum, const std::vector<Moments>& more) {
  for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += more[c];
}

void accumulate_bins(std::vector<double>& sum, const std::vector<double>& more, double weight = 1.0) {
  for (std::size_t bin = 0; bin < sum.size(); ++bin) sum[bin] += weight * more[bin];
}

}  // namespace

Lessons gather_lessons(const Predictor& predictor, std::span<const Window> windows) {
  const int steps = steps_in(predictor.config().horizon_s, predictor.interval_s());
  std::vector<WindowExamples> each(windows.size());
  tbb::enumerable_thread_specific<Workspace> workspaces;
  tbb::parallel_for(std::size_t{0}, windows.size(),
                    [&](std::size_t i) { each[i] = examples_of(predictor, windows[i], steps, workspaces.local()); });
  Lessons sum = empty_lessons(steps, predictor.interval_s());  // in the order of the windows, whatever the threads did
  for (const WindowExamples& examples : each) add(sum, examples);
  return sum;
}

Lessons add_lessons(const Lessons& past, const Lessons& recent, double decay) {
  if (past.empty()) return recent;
  if (recent.empty()) return past;
  if (past.steps != recent.steps || past.classes != recent.classes || past.interval_s != recent.interval_s) {
    throw std::invalid_argument("add_lessons: steps = " + std::to_string(recent.steps) + ", the model was taught " +
                                std::to_string(past.steps) +
                                " steps; keep predict.horizon_s as it was when the model began");
  }
  Lessons sum = faded(past, decay);
  accumulate_cells(sum.with_map, recent.with_map);
  accumulate_cells(sum.without_map, recent.without_map);
  accumulate_cells(sum.residuals_with_map, recent.residuals_with_map);
  accumulate_cells(sum.residuals_without_map, recent.residuals_without_map);
  accumulate_cells(sum.residuals_place_free, recent.residuals_place_free);
  for (std::size_t cell = 0; cell < sum.surprises.size(); ++cell) {
    // Under covariances of which little was known surprises say little: wide ones would hide how large they are now.
    const double known = past.residuals_with_map[cell].weight;
    accumulate_bins(sum.surprises[cell], recent.surprises[cell], known / (known + kWindowsToKnowCovariance));
  }
  accumulate_bins(sum.novelties, recent.novelties);
  return sum;
}

}  // namespace sila
