#include "sila/eval/evaluate.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "sila/core/steps.hpp"
#include "sila/predict/constant_velocity.hpp"

namespace sila {
namespace {

constexpr double kShortestHeading_m = 0.2;
constexpr double kHeadingPart_s = 0.8;

struct JudgedWindow {
  std::size_t track = 0;
  Window window;
};

struct Judged {
  std::vector<JudgedWindow> windows;
  std::vector<SkippedTracks> skipped;
};

Judged windows_with_future(std::span<const PlacedTrack> tracks, const EpisodeConfig& config, double every_s,
                           std::size_t steps) {
  Judged judged;
  std::map<std::string, std::size_t> skipped;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    std::vector<Window> windows = windows_of(tracks.subspan(i, 1), config.sampling, config.predict, every_s);
    const std::size_t before = judged.windows.size();
    for (Window& window : windows) {
      if (window.future_m.size() == steps) judged.windows.push_back({i, std::move(window)});
    }
    if (windows.empty())
      ++skipped["shorter than the observed window"];
    else if (judged.windows.size() == before)
      ++skipped["ends before the horizon"];
  }
  for (const auto& [reason, count] : skipped) judged.skipped.push_back({reason, count});
  return judged;
}

std::vector<Vector2> whole_path(const Window& window) {
  std::vector<Vector2> path;
  for (const Vector2& position : window.observed.positions) path.push_back(to_world(window.observed.frame, position));
  path.insert(path.end(), window.future_m.begin(), window.future_m.end());
  return path;
}

Prediction constant_prediction(const Window& window, int steps, double interval_s,
                               const std::vector<double>& variances_m2) {
  Prediction prediction;
  Mode mode{1.0, constant_velocity(window.observed, steps, interval_s), {}, {}};
  for (double variance : variances_m2) mode.covariances_m2.emplace_back(Matrix2::Identity() * variance);
  prediction.modes.push_back(std::move(mode));
  return prediction;
}

/// The variance per axis and step with which a Gaussian round constant velocity suits the windows best.
std::vector<double> constant_variances(std::span<const JudgedWindow> windows, int steps, double interval_s,
                                       auto belongs) {
  std::vector<double> variances(static_cast<std::size_t>(steps), 0.0);
  std::size_t count = 0;
  for (const JudgedWindow& judged : windows) {
    if (!belongs(judged.window)) continue;
    ++count;
    const std::vector<Vector2> path = constant_velocity(judged.window.observed, steps, interval_s);
    for (std::size_t j = 0; j < path.size(); ++j)
      variances[j] += 0.5 * (path[j] - judged.window.future_m[j]).squaredNorm();
  }
  for (double& variance : variances)
    variance = std::max(1e-4, variance / static_cast<double>(std::max<std::size_t>(1, count)));
  return variances;
}

GroupScore group(const std::string& name, std::span<const WindowScore> windows, std::size_t horizons, auto belongs) {
  GroupScore score{name, 0, 0.0, 0.0, std::vector<Metrics>(horizons), std::vector<Metrics>(horizons)};
  for (const WindowScore& window : windows) {
    if (!belongs(window)) continue;
    ++score.windows;
    score.fallback_rate += window.fallback ? 1.0 : 0.0;
    score.modes += static_cast<double>(window.modes);
    for (std::size_t h = 0; h < horizons; ++h) {
      score.model[h] = score.model[h] + window.model[h];
      score.constant[h] = score.constant[h] + window.constant[h];
    }
  }
  if (score.windows == 0) return score;
  const double share = 1.0 / static_cast<double>(score.windows);
  score.fallback_rate *= share, score.modes *= share;
  for (std::size_t h = 0; h < horizons; ++h) {
    score.model[h] = share * score.model[h];
    score.constant[h] = share * score.constant[h];
  }
  return score;
}

int steps_of(const EpisodeConfig& config) {
  return steps_in(config.predict.horizon_s, config.sampling.interval_s);
}

/// No mode: there was no forecast for this window.
WindowScore judge(const Forecast& forecast, const Window& window, const std::vector<double>& own_variances_m2,
                  const EpisodeConfig& config, const EvaluateConfig& judged, const Background* background) {
  const Prediction prediction = forecast(window.observed);
  if (prediction.modes.empty()) return {};
  if (background == nullptr) return score_window(prediction, window, own_variances_m2, config, judged);
  const bool moving = is_moving(window.observed, judged);
  WindowScore score = score_window(
      prediction, window, moving ? background->moving_variances_m2 : background->standing_variances_m2, config, judged);
  const auto constant_m = constant_velocity(window.observed, steps_of(config), config.sampling.interval_s);
  score.inside = contains(background->area, constant_m.back());
  return score;
}

void add_groups(Evaluation& evaluation, bool with_area) {
  const auto add = [&](const char* name, auto belongs) {
    evaluation.groups.push_back(group(name, evaluation.windows, evaluation.horizons_s.size(), belongs));
  };
  add("all", [](const WindowScore&) { return true; });
  add("moving", [](const WindowScore& w) { return w.moving; });
  add("turning", [](const WindowScore& w) { return w.turning; });
  if (!with_area) return;
  add("inside", [](const WindowScore& w) { return w.moving && w.inside; });
  add("outside", [](const WindowScore& w) { return w.moving && !w.inside; });
}

}  // namespace

bool is_moving(const CurbTrajectory& observed, const EvaluateConfig& judged) {
  const Vector2 moved = observed.positions.back() - observed.positions.front();
  return velocity_to_world(observed.frame, moved).norm() >= judged.moving_m;
}

WindowScore score_window(const Prediction& prediction, const Window& window,
                         const std::vector<double>& constant_variances_m2, const EpisodeConfig& config,
                         const EvaluateConfig& judged) {
  const double interval_s = config.sampling.interval_s;
  WindowScore score;
  score.moving = is_moving(window.observed, judged);
  score.turning = score.moving && heading_change_rad(whole_path(window)) > judged.turning_rad;
  score.track = window.observed.id, score.t0_s = prediction.t0_s;
  score.fallback = prediction.fallback, score.novelty = prediction.novelty, score.modes = prediction.modes.size();
  const Prediction constant = constant_prediction(window, steps_of(config), interval_s, constant_variances_m2);
  for (double horizon_s : horizons_until(config.predict.horizon_s)) {
    const auto count = static_cast<std::size_t>(steps_in(horizon_s, interval_s));
    score.model.push_back(measure(prediction, window.future_m, count));
    score.constant.push_back(measure(constant, window.future_m, count));
  }
  return score;
}

std::vector<double> horizons_until(double horizon_s) {
  std::vector<double> horizons;
  for (double h = 1.0; h < horizon_s - 1e-9; h += 1.0) horizons.push_back(h);
  horizons.push_back(horizon_s);
  return horizons;
}

double heading_change_rad(std::span<const Vector2> path_m) {
  if (path_m.size() < 3) return 0.0;
  const std::size_t part =
      std::max<std::size_t>(1, std::min(path_m.size() / 2, static_cast<std::size_t>(kHeadingPart_s / 0.2)));
  const Vector2 first = path_m[part] - path_m.front();
  const Vector2 last = path_m.back() - path_m[path_m.size() - 1 - part];
  if (first.norm() < kShortestHeading_m || last.norm() < kShortestHeading_m) return 0.0;
  return std::abs(std::atan2(first.x() * last.y() - first.y() * last.x(), first.dot(last)));
}

Background background_of(std::span<const PlacedTrack> train, const EpisodeConfig& config,
                         const EvaluateConfig& judged) {
  const int steps = steps_of(config);
  const std::vector<JudgedWindow> windows =
      windows_with_future(train, config, judged.every_s, static_cast<std::size_t>(steps)).windows;
  const auto variances = [&](bool moving) {
    return constant_variances(windows, steps, config.sampling.interval_s,
                              [&](const Window& window) { return is_moving(window.observed, judged) == moving; });
  };
  return {covered_area(train), variances(true), variances(false)};
}

Evaluation evaluate_forecast(const Forecast& forecast, std::span<const PlacedTrack> tracks, const EpisodeConfig& config,
                             const EvaluateConfig& judged_config, const Background* background) {
  validate_fields("evaluate", judged_config);
  const int steps = steps_of(config);
  const Judged judged = windows_with_future(tracks, config, judged_config.every_s, static_cast<std::size_t>(steps));
  const std::vector<double> own_variances_m2 =
      constant_variances(judged.windows, steps, config.sampling.interval_s, [](const Window&) { return true; });
  Evaluation evaluation;
  evaluation.horizons_s = horizons_until(config.predict.horizon_s);
  evaluation.skipped = judged.skipped;
  evaluation.windows.resize(judged.windows.size());
  tbb::parallel_for(std::size_t{0}, judged.windows.size(), [&](std::size_t i) {
    evaluation.windows[i] =
        judge(forecast, judged.windows[i].window, own_variances_m2, config, judged_config, background);
  });
  std::erase_if(evaluation.windows, [](const WindowScore& window) { return window.modes == 0; });
  add_groups(evaluation, background != nullptr);
  return evaluation;
}

Evaluation evaluate(const Model& model, std::span<const PlacedTrack> tracks, const EpisodeConfig& config,
                    const EvaluateConfig& judged) {
  const Predictor predictor(model, config.predict);
  return evaluate_forecast([&](const CurbTrajectory& observed) { return predictor.predict(observed); }, tracks, config,
                           judged);
}

}  // namespace sila
