#include "sila/eval/evaluate.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

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
std::vector<double> constant_variances(std::span<const JudgedWindow> windows, int steps, double interval_s) {
  std::vector<double> variances(static_cast<std::size_t>(steps), 0.0);
  for (const JudgedWindow& judged : windows) {
    const std::vector<Vector2> path = constant_velocity(judged.window.observed, steps, interval_s);
    for (std::size_t j = 0; j < path.size(); ++j)
      variances[j] += 0.5 * (path[j] - judged.window.future_m[j]).squaredNorm();
  }
  for (double& variance : variances)
    variance = std::max(1e-4, variance / static_cast<double>(std::max<std::size_t>(1, windows.size())));
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

}  // namespace

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

Evaluation evaluate(const Model& model, std::span<const PlacedTrack> tracks, const EpisodeConfig& config,
                    const EvaluateConfig& judged_config) {
  validate_fields("evaluate", judged_config);
  const double interval_s = model.conventions.sample_interval_s;
  const int steps = static_cast<int>(std::lround(config.predict.horizon_s / interval_s));
  const Predictor predictor(model, config.predict);
  const Judged judged = windows_with_future(tracks, config, judged_config.every_s, static_cast<std::size_t>(steps));
  const std::vector<double> variances_m2 = constant_variances(judged.windows, steps, interval_s);

  Evaluation evaluation;
  evaluation.horizons_s = horizons_until(config.predict.horizon_s);
  evaluation.skipped = judged.skipped;
  evaluation.windows.resize(judged.windows.size());
  tbb::parallel_for(std::size_t{0}, judged.windows.size(), [&](std::size_t i) {
    const Window& window = judged.windows[i].window;
    const Prediction prediction = predictor.predict(window.observed);
    const Prediction constant = constant_prediction(window, steps, interval_s, variances_m2);
    WindowScore& score = evaluation.windows[i];
    score.track = window.observed.id, score.t0_s = prediction.t0_s;
    score.fallback = prediction.fallback, score.novelty = prediction.novelty, score.modes = prediction.modes.size();
    const Vector2 moved = window.observed.positions.back() - window.observed.positions.front();
    score.moving = velocity_to_world(window.observed.frame, moved).norm() >= judged_config.moving_m;
    score.turning = score.moving && heading_change_rad(whole_path(window)) > judged_config.turning_rad;
    for (double horizon_s : evaluation.horizons_s) {
      const auto count = static_cast<std::size_t>(std::lround(horizon_s / interval_s));
      score.model.push_back(measure(prediction, window.future_m, count));
      score.constant.push_back(measure(constant, window.future_m, count));
    }
  });
  const std::size_t horizons = evaluation.horizons_s.size();
  evaluation.groups.push_back(group("all", evaluation.windows, horizons, [](const WindowScore&) { return true; }));
  evaluation.groups.push_back(
      group("moving", evaluation.windows, horizons, [](const WindowScore& w) { return w.moving; }));
  evaluation.groups.push_back(
      group("turning", evaluation.windows, horizons, [](const WindowScore& w) { return w.turning; }));
  return evaluation;
}

}  // namespace sila
