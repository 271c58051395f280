#pragma once

#include <span>
#include <string>
#include <vector>

#include "sila/episode/episode.hpp"
#include "sila/eval/metrics.hpp"

namespace sila {

/// Which windows are judged and how they are parted.
struct EvaluateConfig {
  double every_s = 1.6;
  double moving_m = 0.5;
  double turning_rad = 0.5235987755982988;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, EvaluateConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("every_s", config.every_s, Range{0.0, 600.0, true}, "s", "between the windows of a track");
  visit.number("moving_m", config.moving_m, Range{0.0, 100.0}, "m",
               "a window is moving from this displacement on while observed");
  visit.number("turning_rad", config.turning_rad, Range{0.0, 3.2}, "rad",
               "a moving window is turning if the heading changes by more from its start to its end");
}

/// One judged window.
struct WindowScore {
  std::string track;
  double t0_s = 0.0;
  bool moving = false;
  bool turning = false;
  bool fallback = false;
  double novelty = 0.0;
  std::size_t modes = 0;
  std::vector<Metrics> model;     ///< at each horizon
  std::vector<Metrics> constant;  ///< constant velocity on the same window
};

/// Means over a group of windows.
struct GroupScore {
  std::string name;  ///< all, moving, turning
  std::size_t windows = 0;
  double fallback_rate = 0.0;
  double modes = 0.0;          ///< on average
  std::vector<Metrics> model;  ///< at each horizon
  std::vector<Metrics> constant;
};

struct SkippedTracks {
  std::string reason;
  std::size_t tracks = 0;
};

struct Evaluation {
  std::vector<double> horizons_s;  ///< 1, 2, ... and the whole horizon
  std::vector<GroupScore> groups;
  std::vector<WindowScore> windows;
  std::vector<SkippedTracks> skipped;  ///< tracks that gave no window
};

/// Judges a model on tracks, beside constant velocity (of the last 0.8 s) on the same windows. A window needs its whole
/// future. The density of constant velocity is a Gaussian whose variance at each step is the one that suits these
/// windows best. Throws: std::invalid_argument for a configuration out of range.
Evaluation evaluate(const Model& model, std::span<const PlacedTrack> tracks, const EpisodeConfig& config,
                    const EvaluateConfig& judged);

/// The horizons of `Evaluation`: whole seconds below `horizon_s`, then `horizon_s`.
std::vector<double> horizons_until(double horizon_s);

/// Change of heading from the first to the last part of a path [rad], in [0, pi]; 0 if either part is shorter than 0.2
/// m.
double heading_change_rad(std::span<const Vector2> path_m);

}  // namespace sila
