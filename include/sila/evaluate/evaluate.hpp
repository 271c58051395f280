#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sila/evaluate/metrics.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// Which windows are scored and how they are grouped.
struct EvaluateConfig {
  double stride_s = 1.6;
  double observed_s = 60.0;
  /// A moving window is turning if the heading changes by more, 30 degrees, from its start to its end [rad].
  static constexpr double turning_rad = 0.5235987755982988;
};

void fields(MaybeConst<EvaluateConfig> auto& config, auto&& visit) {
  visit.number("stride_s", config.stride_s, Range{0.0, 600.0, true}, "s", "time between the windows of a track");
  visit.number("observed_s", config.observed_s, Range{0.0, 60.0}, "s",
               "observed part of each window, at most, as if the person had just appeared");
}

struct WindowScore {
  std::string track;
  double t0_s = 0.0;
  bool moving = false;
  bool turning = false;
  bool inside = true;  ///< constant velocity ends in the area that the training tracks cover; true if none is known
  bool fallback = false;
  double novelty = 0.0;
  std::size_t modes = 0;
  std::vector<Metrics> model;       ///< at each horizon
  std::vector<Metrics> constant;    ///< constant velocity on the same window
  std::vector<Metrics> references;  ///< at the whole horizon, as kReferences; without training support the first two
  std::size_t motion_state = kWalking;    ///< by the prediction
  std::vector<ChangeForecast> changes;    ///< at each horizon; empty if the prediction has none
  std::vector<OutcomeForecast> outcomes;  ///< at each horizon
  /// At a fork: log-probability of the way that was taken [nats] (evaluate/training_support.hpp).
  std::optional<double> way_log_probability;
};

/// Means over a group of windows.
struct GroupScore {
  /// all, moving, standing, turning; with training support also inside and outside, of the moving ones.
  std::string name;
  std::size_t windows = 0;
  double fallback_rate = 0.0;
  double modes = 0.0;          ///< on average
  std::vector<Metrics> model;  ///< at each horizon
  std::vector<Metrics> constant;
  std::vector<Metrics> references;  ///< as in WindowScore
};

/// The scores of a predictor on some tracks: each window, and means over groups of windows.
struct Evaluation {
  std::vector<double> horizons_s;  ///< 1, 2, ... and the whole horizon
  std::vector<GroupScore> groups;
  std::vector<ChangeScore> changes;    ///< of starting, then of stopping, at each horizon; none without such windows
  std::vector<OutcomeScore> outcomes;  ///< of people who stand, then of those who walk, at each horizon
  std::vector<WindowScore> windows;
  std::map<std::string, std::size_t> skipped;  ///< number of tracks without a window, by reason
};

/// A predictor: a prepared model, a baseline, or recorded predictions. No mode means no prediction: such windows are
/// left out. Called from many threads.
using Forecast = std::function<Prediction(const CurbTrajectory& observed)>;

/// What an evaluation needs of the training tracks. Their windows have the stride of those of the test tracks. Throws:
/// as windows_of (sila/train/episode.hpp).
TrainingSupport training_support(std::span<const FramedTrajectory> train, const EpisodeConfig& config,
                                 const EvaluateConfig& evaluate_config);

/// Scores a forecast on tracks, beside the references on the same windows. A window needs its whole future. The true
/// path is the raw track. The references are those of `support`; without it they are constant velocity and "stays",
/// with Gaussian errors fitted to these same windows. Throws: std::invalid_argument for a configuration out of range, a
/// track that breaks its invariant, or a forecast shorter than the horizon.
Evaluation evaluate_forecast(const Forecast& forecast, std::span<const FramedTrajectory> tracks,
                             const EpisodeConfig& config, const EvaluateConfig& evaluate_config,
                             const TrainingSupport* support = nullptr);

/// The same for a model. Throws: also as Predictor.
Evaluation evaluate(const Model& model, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                    const EvaluateConfig& evaluate_config);

/// Scores one prediction against the recorded future, beside references of which the first is constant velocity;
/// without knowledge of a covered area. Throws: std::invalid_argument if the future or the prediction is shorter than
/// the horizon, or the prediction has other steps than `sampling.interval_s`.
WindowScore score_window(const Prediction& prediction, const Window& window,
                         std::span<const LinearReference> references, const EpisodeConfig& config,
                         const EvaluateConfig& evaluate_config);

/// The horizons of `Evaluation`: whole seconds below `horizon_s`, then `horizon_s`.
std::vector<double> horizons_until(double horizon_s);

/// Change of heading from the first 0.8 s to the last 0.8 s of a path [rad], in [0, pi]; 0 if either part is shorter
/// than 0.2 m.
double heading_change_rad(std::span<const Vector2> path_m, double interval_s);

/// Predictions by track and t0.
using RecordedPredictions = std::map<std::pair<std::string, double>, Prediction>;

/// The recorded prediction of a track (by its id, or that of its person) at the end of the observed path.
Forecast forecast_of(const RecordedPredictions& recorded);

/// Number of predictions whose track and t0 belong to no sample of these tracks.
std::size_t count_without_track(const RecordedPredictions& recorded, std::span<const FramedTrajectory> tracks);

}  // namespace sila
