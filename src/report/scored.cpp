#include "report/scored.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <concepts>
#include <cstdio>
#include <numbers>

#include "core/kinematics.hpp"
#include "report/encode.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

constexpr double kStanding_m = 0.5;
constexpr double kSetOff_m = 1.0;
constexpr double kStoppedShare = 0.35;
constexpr double kSlowerShare = 0.7;
constexpr double kFasterShare = 1.4;
constexpr double kUnknown = 0.5;
constexpr double kTurn_rad = 0.6;

double length_m(std::span<const Vector2> path_m) {
  double sum = 0.0;
  for (std::size_t i = 1; i < path_m.size(); ++i) sum += (path_m[i] - path_m[i - 1]).norm();
  return sum;
}

std::string text(const char* format, std::same_as<double> auto... numbers) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, numbers...);
  return buffer;
}

ScoredPrediction score_one(const Predictor& predictor, std::size_t track, Window window,
                           std::span<const double> horizons_s) {
  ScoredPrediction scored{
      track, predictor.predict(window.observed), std::move(window.past_m), std::move(window.future_m), {}, {}, {}, {}};
  const std::size_t steps = scored.truth_m.size();
  scored.constant_m = constant_velocity(scored.observed_m, static_cast<int>(steps), predictor.interval_s());
  Prediction constant;
  constant.modes.push_back({1.0, scored.constant_m, std::vector<Matrix2>(steps, Matrix2::Identity()), {}});
  scored.model = measure(scored.prediction, scored.truth_m, steps);
  scored.constant = measure(constant, scored.truth_m, steps);
  for (double horizon_s : horizons_s) {
    const auto count = static_cast<std::size_t>(steps_in(horizon_s, predictor.interval_s()));
    scored.horizons.push_back(measure(scored.prediction, scored.truth_m, count));
  }
  return scored;
}

/// The weight of the mode that came nearest to the truth.
double weight_of_nearest(const ScoredPrediction& scored) {
  const auto distance_m = [&](const Mode& mode) {
    double sum_m = 0.0;
    for (std::size_t j = 0; j < scored.truth_m.size(); ++j) sum_m += (mode.path_m[j] - scored.truth_m[j]).norm();
    return sum_m;
  };
  return std::ranges::min_element(scored.prediction.modes, {}, distance_m)->weight;
}

/// From the observed direction to that at the end of a path [rad].
double turn_rad(const ScoredPrediction& scored, std::span<const Vector2> path_m, double interval_s) {
  std::vector<Vector2> whole_m = scored.observed_m;
  whole_m.insert(whole_m.end(), path_m.begin(), path_m.end());
  return heading_change_rad(whole_m, interval_s);
}

/// Of a person who turned by `turned_rad`.
std::string reason_of_turn(const ScoredPrediction& scored, double turned_rad, double interval_s) {
  const bool foreseen = std::ranges::any_of(scored.prediction.modes, [&](const Mode& mode) {
    return turn_rad(scored, mode.path_m, interval_s) > 0.5 * turned_rad;
  });
  return text("turned by %.0f degrees", turned_rad * 180.0 / std::numbers::pi) +
         (foreseen ? ", but not where a mode did" : ", as no mode did");
}

}  // namespace

std::vector<ScoredPrediction> score_predictions(const Model& model, std::span<const FramedTrajectory> tracks,
                                                const EpisodeConfig& config, double stride_s) {
  const Predictor predictor(model, config.predict);
  const auto steps = static_cast<std::size_t>(steps_in(config.predict.horizon_s, predictor.interval_s()));
  const std::vector<double> horizons_s = horizons_until(config.predict.horizon_s);
  std::vector<std::pair<std::size_t, Window>> windows;
  const PresentPeople present(tracks);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    for (Window& window : windows_of(tracks.subspan(i, 1), config.sampling, config.predict, stride_s, {}, &present)) {
      if (window.future_m.size() == steps) windows.emplace_back(i, std::move(window));
    }
  }
  std::vector<ScoredPrediction> scored(windows.size());
  tbb::parallel_for(std::size_t{0}, windows.size(), [&](std::size_t i) {
    scored[i] = score_one(predictor, windows[i].first, std::move(windows[i].second), horizons_s);
  });
  return scored;
}

std::string reason_of(const ScoredPrediction& scored, double interval_s) {
  const double seen_m = length_m(scored.observed_m);
  const double went_m = length_m(scored.truth_m), expected_m = length_m(scored.constant_m);
  const Vector2 net_m = scored.observed_m.back() - scored.observed_m.front();
  const std::vector<Mode>& modes = scored.prediction.modes;
  if (net_m.norm() < kStanding_m && went_m > kSetOff_m && went_m > 2.0 * expected_m) return "stood and set off";
  if (went_m < kStoppedShare * expected_m && seen_m > kStanding_m) return "stopped";
  if (scored.prediction.fallback) return "walked where no track had walked: kinematics alone";
  if (scored.prediction.novelty > kUnknown)
    return text("walked where few had walked (novelty %.0f %%)", 100.0 * scored.prediction.novelty);
  if (modes.size() > 1 && scored.model.best_ade_m < 0.5 * scored.model.ade_m) {
    return text("followed a mode that had a weight of %.1f %%", 100.0 * weight_of_nearest(scored));
  }
  const double turned_rad = turn_rad(scored, scored.truth_m, interval_s);
  if (turned_rad > kTurn_rad) return reason_of_turn(scored, turned_rad, interval_s);
  if (went_m > kFasterShare * expected_m)
    return text("walked faster: %.1f m instead of %.1f m at its observed speed", went_m, expected_m);
  if (went_m < kSlowerShare * expected_m)
    return text("slowed down: %.1f m instead of %.1f m at its observed speed", went_m, expected_m);
  return text("kept its speed, but ended %.1f m from the most likely mode", scored.model.fde_m);
}

nlohmann::ordered_json reliability_json(std::span<const ScoredPrediction> scored, double horizon_s) {
  auto list = nlohmann::ordered_json::array();
  if (scored.empty()) return list;
  const std::vector<double> horizons_s = horizons_until(horizon_s);
  for (std::size_t h = 0; h < horizons_s.size(); ++h) {
    auto observed = nlohmann::ordered_json::array();
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      double inside = 0.0;
      for (const ScoredPrediction& prediction : scored) inside += prediction.horizons[h].coverage[p];
      observed.push_back(detail::rounded(inside / static_cast<double>(scored.size()), 4));
    }
    list.push_back(
        {{"horizon_s", horizons_s[h]}, {"nominal", kRegionProbabilities}, {"observed", std::move(observed)}});
  }
  return list;
}

}  // namespace sila
