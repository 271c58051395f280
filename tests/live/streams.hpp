#pragma once

// Streams of detections for tests.

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "sila/live/live.hpp"
#include "support/walks.hpp"

namespace sila::testing {

inline LiveSettings live_settings() {
  LiveSettings settings;
  settings.frame_for = [](const Trajectory&) { return square_frame(); };
  return settings;
}

/// The samples of tracks as a tracker would send them, in the order of time; track i begins `apart_s` after the one
/// before it.
inline std::vector<Detection> stream_of(const std::vector<Trajectory>& tracks, double apart_s) {
  std::vector<Detection> rows;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    for (std::size_t k = 0; k < tracks[i].times_s.size(); ++k)
      rows.push_back({tracks[i].id, tracks[i].times_s[k] + apart_s * static_cast<double>(i), tracks[i].positions_m[k]});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Detection& a, const Detection& b) { return a.t_s < b.t_s; });
  return rows;
}

inline std::vector<Trajectory> paths_of(const std::vector<FramedTrajectory>& placed) {
  std::vector<Trajectory> paths;
  for (const FramedTrajectory& track : placed) paths.push_back(track.track);
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

/// Prediction without a model: stands where the person was, with a metre of doubt.
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

/// Asks and answers all that is due.
inline void answer_all(Live& live, const LiveSettings& settings) {
  for (const Question& question : ask(live, 1000, settings))
    keep(live, question, calibrated(standing_prediction(question.observed, settings.episode), live.online_calibration),
         settings);
  judge_ripe(live, 1000, settings);
}

}  // namespace sila::testing
