#pragma once

// Made-up walks for tests.

#include <random>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila::testing {

inline CurbFrame square_frame(double width_m = 2.5, CurbScaling scaling = CurbScaling::metres) {
  return rescaled(make_curb_frame({0, 0}, {1, 0}, {0, 1}, width_m), scaling);
}

/// Tracks of one frame.
inline std::vector<FramedTrajectory> framed(const std::vector<Trajectory>& tracks, const CurbFrame& frame) {
  std::vector<FramedTrajectory> result;
  for (const Trajectory& track : tracks) result.push_back({track, frame});
  return result;
}

/// A track of `samples` positions, the first at 0 s.
template <class Position>
Trajectory sampled(int samples, double interval_s, Position&& position_at, const std::string& id = "a") {
  Trajectory track{id, {}, {}};
  for (int k = 0; k < samples; ++k) {
    track.times_s.push_back(interval_s * k);
    track.positions_m.push_back(position_at(k));
  }
  return track;
}

/// A walk through way points at a constant speed, sampled every `interval_s`, with Gaussian noise.
inline Trajectory walk(const std::string& id, const std::vector<Vector2>& way, double speed_mps,
                       double interval_s = 0.1, double noise_m = 0.0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Trajectory track{id, {}, {}};
  double along_m = 0.0, length_m = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) length_m += (way[i] - way[i - 1]).norm();
  for (int k = 0; along_m <= length_m + 1e-9; ++k, along_m = k * interval_s * speed_mps) {
    double rest = along_m;
    Vector2 position = way.back();
    for (std::size_t i = 1; i < way.size(); ++i) {
      const double part = (way[i] - way[i - 1]).norm();
      if (rest <= part) {
        position = way[i - 1] + (way[i] - way[i - 1]) * (rest / part);
        break;
      }
      rest -= part;
    }
    track.times_s.push_back(k * interval_s);
    const double y = normal(random), x = normal(random);  // arguments have no defined order of evaluation
    track.positions_m.emplace_back(position + noise_m * Vector2(x, y));
  }
  return track;
}

/// People who come along curb 1 and turn round the corner into curb 2, or walk straight on, each at a speed and offset
/// of their own, and each in a recording of its own.
inline std::vector<FramedTrajectory> corner_walks(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<FramedTrajectory> tracks;
  for (int i = 0; i < count; ++i) {
    const double offset = 0.5 + 1.5 * uniform(random), speed = 1.1 + 0.5 * uniform(random);
    const bool turns = uniform(random) < 0.5;
    std::vector<Vector2> way = turns ? std::vector<Vector2>{{14.0, offset}, {offset, offset}, {offset, 14.0}}
                                     : std::vector<Vector2>{{14.0, offset}, {-14.0, offset}};
    tracks.push_back(
        {walk("w" + std::to_string(i), way, speed, 0.1, 0.02, seed + static_cast<unsigned>(i)), square_frame()});
    tracks.back().track.recording = static_cast<std::size_t>(i);
  }
  return tracks;
}

/// `corner_walks` at another place.
inline std::vector<FramedTrajectory> walks_at(const CurbFrame& frame, int count, unsigned seed) {
  std::vector<FramedTrajectory> tracks = corner_walks(count, seed);
  for (FramedTrajectory& placed : tracks) {
    for (Vector2& p : placed.track.positions_m) p = to_world(frame, p);
    placed.frame = frame;
  }
  return tracks;
}

}  // namespace sila::testing
