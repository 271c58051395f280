#pragma once

// Streams of detections for tests.

#include <algorithm>
#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include "sila/service/stream.hpp"
#include "support/walks.hpp"

namespace sila::testing {

/// Waits until a condition holds, at most two minutes; whether it does.
template <class Condition>
bool comes_true(Condition&& condition) {
  for (int tries = 0; tries < 12000 && !condition(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return condition();
}

inline ServiceSettings service_settings() {
  ServiceSettings settings;
  settings.frame_for = [](const Trajectory&) { return square_frame(); };
  return settings;
}

/// The samples of tracks in order of time, as a tracker sends them; each track begins `apart_s` after the one before
/// it.
inline std::vector<Detection> stream_of(const std::vector<Trajectory>& tracks, double apart_s) {
  std::vector<Detection> rows;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    for (std::size_t k = 0; k < tracks[i].times_s.size(); ++k)
      rows.push_back({tracks[i].id, tracks[i].times_s[k] + apart_s * static_cast<double>(i), tracks[i].positions_m[k]});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Detection& a, const Detection& b) { return a.t_s < b.t_s; });
  return rows;
}

inline std::vector<Trajectory> paths_of(const std::vector<FramedTrajectory>& framed) {
  std::vector<Trajectory> paths;
  for (const FramedTrajectory& track : framed) paths.push_back(track.track);
  return paths;
}

/// The same rows, each delayed by up to `late_s`.
inline std::vector<Detection> delayed(std::vector<Detection> rows, double late_s, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> delay(0.0, late_s);
  std::vector<std::pair<double, Detection>> timed;
  for (Detection& row : rows) timed.emplace_back(row.t_s + delay(random), std::move(row));
  std::stable_sort(timed.begin(), timed.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  rows.clear();
  for (auto& [time_s, row] : timed) rows.push_back(std::move(row));
  return rows;
}

/// Prediction without a model: the last position with a standard deviation of 1 m.
inline Prediction standing_prediction(const CurbTrajectory& observed, const EpisodeConfig& config) {
  const auto steps = static_cast<int>(std::lround(config.predict.horizon_s / config.sampling.interval_s));
  const Vector2 here = to_world(observed.frame, observed.positions.back());
  Prediction prediction;
  prediction.t0_s = observed.times_s.back();
  prediction.modes.push_back({1.0, {}, {}, {}});
  for (int j = 1; j <= steps; ++j) {
    prediction.times_s.push_back(j * config.sampling.interval_s);
    prediction.modes.front().path_m.push_back(here);
    prediction.modes.front().covariances_m2.emplace_back(Matrix2::Identity());
  }
  for (const double probability : kRegionProbabilities)
    prediction.regions.push_back(
        {probability, std::vector<double>(prediction.times_s.size(), -std::log1p(-probability))});
  return prediction;
}

/// Makes all due predictions.
inline void answer_all(StreamCore& core, const ServiceSettings& settings) {
  for (const PredictionRequest& request : take_due_requests(core, 1000, settings))
    retain(core, request, calibrated(standing_prediction(request.observed, settings.episode), core.online_calibration),
           settings);
  score_due(core, 1000, settings);
}

}  // namespace sila::testing
