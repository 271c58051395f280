#include "sila/evaluate/evaluate.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "refine/motion_change.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

constexpr double kShortestHeading_m = 0.2;
constexpr double kHeadingPart_s = 0.8;

int steps_of(const EpisodeConfig& config) {
  return steps_in(config.predict.horizon_s, config.sampling.interval_s);
}

struct TestWindows {
  std::vector<Window> windows;
  std::map<std::string, std::size_t> skipped;  ///< number of tracks without a window, by reason
};

TestWindows windows_with_future(std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                                const EvaluateConfig& evaluate_config) {
  const auto steps = static_cast<std::size_t>(steps_of(config));
  TestWindows found;
  const PresentPeople present(tracks);
  const std::string too_short = concatenate("a track must last at least ", config.predict.observe_s, " s observed and ",
                                            config.predict.horizon_s, " s predicted");
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::size_t before = found.windows.size();
    for (Window& window : windows_of(tracks.subspan(i, 1), config.sampling, config.predict, evaluate_config.stride_s,
                                     std::span(&evaluate_config.observed_s, 1), &present)) {
      if (window.future_m.size() == steps) found.windows.push_back(std::move(window));
    }
    if (found.windows.size() == before) ++found.skipped[too_short];
  }
  return found;
}

std::vector<Vector2> whole_path(const Window& window) {
  std::vector<Vector2> path = window.past_m;
  path.insert(path.end(), window.future_m.begin(), window.future_m.end());
  return path;
}

void add(std::vector<Metrics>& sums, const std::vector<Metrics>& more) {
  sums.resize(std::max(sums.size(), more.size()));
  for (std::size_t i = 0; i < more.size(); ++i) sums[i] = sums[i] + more[i];
}

GroupScore group(const std::string& name, std::span<const WindowScore> windows, std::size_t horizons, auto belongs) {
  GroupScore score{name, 0, 0.0, 0.0, std::vector<Metrics>(horizons), std::vector<Metrics>(horizons), {}};
  for (const WindowScore& window : windows) {
    if (!belongs(window)) continue;
    ++score.windows;
    score.fallback_rate += window.fallback ? 1.0 : 0.0;
    score.modes += static_cast<double>(window.modes);
    add(score.model, window.model);
    add(score.constant, window.constant);
    add(score.references, window.references);
  }
  const double share = 1.0 / static_cast<double>(std::max<std::size_t>(1, score.windows));
  score.fallback_rate *= share;
  score.modes *= share;
  for (std::vector<Metrics>* sums : {&score.model, &score.constant, &score.references}) {
    for (Metrics& sum : *sums) sum = share * sum;
  }
  return score;
}

/// Whether a pedestrian moved by kMoving_m while observed; in proportion where `observed_s` shortens it.
bool is_moving(const Window& window, const EpisodeConfig& config, const EvaluateConfig& evaluate_config) {
  const double share = std::min(1.0, evaluate_config.observed_s / config.predict.observe_s);
  return (window.past_m.back() - window.past_m.front()).norm() >= share * kMoving_m;
}

ReferencesByMotion references_on(std::span<const Window> windows, const EpisodeConfig& config,
                                 const EvaluateConfig& evaluate_config, std::size_t count) {
  std::array<std::vector<const Window*>, 2> by_motion;
  for (const Window& window : windows) by_motion[is_moving(window, config, evaluate_config) ? 1 : 0].push_back(&window);
  const auto fitted_to = [&](std::span<const Window* const> chosen) {
    return fit_references(chosen, static_cast<std::size_t>(steps_of(config)), config.sampling.interval_s, count);
  };
  return {fitted_to(by_motion[0]), fitted_to(by_motion[1])};
}

/// No mode: there was no forecast for this window.
WindowScore score_forecast(const Forecast& forecast, const Window& window, const ReferencesByMotion& references,
                           const EpisodeConfig& config, const EvaluateConfig& evaluate_config,
                           const TrainingSupport* support) {
  const Prediction prediction = forecast(window.observed);
  if (prediction.modes.empty()) return {};
  const bool moving = is_moving(window, config, evaluate_config);
  WindowScore score = score_window(prediction, window, references[moving ? 1 : 0], config, evaluate_config);
  if (support == nullptr) return score;
  const auto constant_m = constant_velocity(window.past_m, steps_of(config), config.sampling.interval_s);
  score.inside = contains(support->area, constant_m.back());
  const std::vector<Way> ways = ways_on(support->passages, window, config.sampling.interval_s);
  if (const auto probability = probability_of_way_taken(prediction, window, ways))
    score.way_log_probability = std::log(*probability);
  return score;
}

void add_groups(Evaluation& evaluation, bool with_area) {
  const auto add = [&](const char* name, auto belongs) {
    evaluation.groups.push_back(group(name, evaluation.windows, evaluation.horizons_s.size(), belongs));
  };
  add("all", [](const WindowScore&) { return true; });
  add("moving", [](const WindowScore& w) { return w.moving; });
  add("standing", [](const WindowScore& w) { return !w.moving; });
  add("turning", [](const WindowScore& w) { return w.turning; });
  if (!with_area) return;
  add("inside", [](const WindowScore& w) { return w.moving && w.inside; });
  add("outside", [](const WindowScore& w) { return w.moving && !w.inside; });
}

/// The forecasts at a horizon of people who stand or walk; `member`: of a window, at each horizon.
template <class ForecastType>
std::vector<ForecastType> forecasts_at(const Evaluation& evaluation, std::size_t state, std::size_t horizon,
                                       std::vector<ForecastType> WindowScore::*member) {
  std::vector<ForecastType> forecasts;
  for (const WindowScore& window : evaluation.windows) {
    if (window.motion_state == state && !(window.*member).empty()) forecasts.push_back((window.*member)[horizon]);
  }
  return forecasts;
}

void add_changes_and_outcomes(Evaluation& evaluation) {
  for (const std::size_t state : {kStanding, kWalking}) {
    for (std::size_t h = 0; h < evaluation.horizons_s.size(); ++h) {
      const double horizon_s = evaluation.horizons_s[h];
      const auto changes = forecasts_at(evaluation, state, h, &WindowScore::changes);
      if (!changes.empty()) evaluation.changes.push_back(score_changes(state, horizon_s, changes));
      const auto outcomes = forecasts_at(evaluation, state, h, &WindowScore::outcomes);
      if (!outcomes.empty()) evaluation.outcomes.push_back(score_outcomes(state, horizon_s, outcomes));
    }
  }
}

/// Steps are compared by their number. Times in lines are rounded.
void require_interval(const Prediction& prediction, double interval_s) {
  if (prediction.times_s.empty()) return;
  const double found_s = prediction.times_s.back() / static_cast<double>(prediction.times_s.size());
  if (std::abs(found_s - interval_s) <= 0.1 * interval_s) return;
  throw invalid_argument("evaluate: a prediction has steps of ", found_s,
                         " s, those of sampling.interval_s = ", interval_s, " s are needed");
}

}  // namespace

WindowScore score_window(const Prediction& prediction, const Window& window,
                         std::span<const LinearReference> references, const EpisodeConfig& config,
                         const EvaluateConfig& evaluate_config) {
  const double interval_s = config.sampling.interval_s;
  require_interval(prediction, interval_s);
  WindowScore score;
  score.moving = is_moving(window, config, evaluate_config);
  score.turning = score.moving && heading_change_rad(whole_path(window), interval_s) > evaluate_config.turning_rad;
  score.track = window.observed.id;
  score.t0_s = prediction.t0_s;
  score.fallback = prediction.fallback;
  score.novelty = prediction.novelty;
  score.modes = prediction.modes.size();
  const Prediction constant = references.front().predict(window.past_m, interval_s);
  score.motion_state = prediction.standing ? kStanding : kWalking;
  const std::optional<std::size_t> change = change_step(score.motion_state, window.past_m, window.future_m, interval_s);
  for (double horizon_s : horizons_until(config.predict.horizon_s)) {
    const auto count = static_cast<std::size_t>(steps_in(horizon_s, interval_s));
    score.model.push_back(measure(prediction, window.future_m, count));
    score.constant.push_back(measure(constant, window.future_m, count));
    if (!prediction.change_probabilities.empty())
      score.changes.push_back({prediction.change_probabilities.at(count - 1), change && *change < count});
    if (!prediction.heading.isZero())
      score.outcomes.push_back(
          {outcome_probabilities(prediction, count - 1), outcome_of(prediction, window.future_m[count - 1])});
  }
  const auto steps = static_cast<std::size_t>(steps_of(config));
  for (const LinearReference& reference : references)
    score.references.push_back(measure(reference.predict(window.past_m, interval_s), window.future_m, steps));
  return score;
}

std::vector<double> horizons_until(double horizon_s) {
  std::vector<double> horizons;
  for (double h = 1.0; h < horizon_s - 1e-9; h += 1.0) horizons.push_back(h);
  horizons.push_back(horizon_s);
  return horizons;
}

double heading_change_rad(std::span<const Vector2> path_m, double interval_s) {
  if (path_m.size() < 3) return 0.0;
  const std::size_t part = std::min(path_m.size() / 2, static_cast<std::size_t>(steps_in(kHeadingPart_s, interval_s)));
  const Vector2 first = path_m[part] - path_m.front();
  const Vector2 last = path_m.back() - path_m[path_m.size() - 1 - part];
  if (first.norm() < kShortestHeading_m || last.norm() < kShortestHeading_m) return 0.0;
  return std::abs(std::atan2(cross(first, last), first.dot(last)));
}

TrainingSupport training_support(std::span<const FramedTrajectory> train, const EpisodeConfig& config,
                                 const EvaluateConfig& evaluate_config) {
  const std::vector<Window> windows = windows_with_future(train, config, evaluate_config).windows;
  return {covered_area(train), references_on(windows, config, evaluate_config, kReferenceCount),
          passages_of(windows, config.sampling.interval_s)};
}

Evaluation evaluate_forecast(const Forecast& forecast, std::span<const FramedTrajectory> tracks,
                             const EpisodeConfig& config, const EvaluateConfig& evaluate_config,
                             const TrainingSupport* support) {
  validate_fields("evaluate", evaluate_config);
  TestWindows found = windows_with_future(tracks, config, evaluate_config);
  // The paths of other references would be fitted to the windows that they are scored on.
  const ReferencesByMotion own =
      support ? ReferencesByMotion{} : references_on(found.windows, config, evaluate_config, 2);
  Evaluation evaluation;
  evaluation.horizons_s = horizons_until(config.predict.horizon_s);
  evaluation.skipped = std::move(found.skipped);
  evaluation.windows.resize(found.windows.size());
  tbb::parallel_for(std::size_t{0}, found.windows.size(), [&](std::size_t i) {
    evaluation.windows[i] = score_forecast(forecast, found.windows[i], support ? support->references : own, config,
                                           evaluate_config, support);
  });
  std::erase_if(evaluation.windows, [](const WindowScore& window) { return window.modes == 0; });
  add_groups(evaluation, support != nullptr);
  add_changes_and_outcomes(evaluation);
  return evaluation;
}

Evaluation evaluate(const Model& model, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                    const EvaluateConfig& evaluate_config) {
  const Predictor predictor(model, config.predict);
  return evaluate_forecast([&](const CurbTrajectory& observed) { return predictor.predict(observed); }, tracks, config,
                           evaluate_config);
}

Forecast forecast_of(const RecordedPredictions& recorded) {
  return [&recorded](const CurbTrajectory& observed) {
    for (const std::string& track : {observed.id, person_of(observed.id)}) {
      const auto found = recorded.find({track, observed.times_s.back()});
      if (found != recorded.end()) return found->second;
    }
    return Prediction{};
  };
}

std::size_t count_without_track(const RecordedPredictions& recorded, std::span<const FramedTrajectory> tracks) {
  std::multimap<std::string, const std::vector<double>*> times_s;
  for (const FramedTrajectory& framed : tracks) {
    for (const std::string& id : {framed.track.id, person_of(framed.track.id)})
      times_s.emplace(id, &framed.track.times_s);
  }
  return static_cast<std::size_t>(std::ranges::count_if(recorded, [&](const auto& entry) {
    const double t0_s = entry.first.second;
    const auto [first, last] = times_s.equal_range(entry.first.first);
    return std::none_of(first, last, [&](const auto& of) { return std::ranges::binary_search(*of.second, t0_s); });
  }));
}

}  // namespace sila
