#pragma once

#include <concepts>
#include <span>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// A memory of all that was seen: nothing is generalised, so it is as large as the data.
struct MemoryConfig {
  int neighbours = 25;
  double every_s = 0.4;
  double position_m = 2.0;
  double velocity_mps = 0.3;
  double mean_velocity_mps = 0.6;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, MemoryConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("neighbours", config.neighbours, Range{1, 1000}, "-", "remembered windows that a prediction is made of");
  visit.number("every_s", config.every_s, Range{0.0, 60.0, true}, "s", "between the remembered windows of a track");
  visit.number("position_m", config.position_m, Range{0.0, 100.0, true}, "m", "a difference in place that counts 1");
  visit.number("velocity_mps", config.velocity_mps, Range{0.0, 100.0, true}, "m/s",
               "a difference in the velocity of the last 0.8 s that counts 1");
  visit.number("mean_velocity_mps", config.mean_velocity_mps, Range{0.0, 100.0, true}, "m/s",
               "a difference in the mean velocity over the observed window that counts 1");
}

/// How a person moved, and what came of it; in the metres of the memory's frame.
struct RememberedWindow {
  Vector2 position_m = Vector2::Zero();
  Vector2 velocity_mps = Vector2::Zero();       ///< of the last 0.8 s
  Vector2 mean_velocity_mps = Vector2::Zero();  ///< over the observed window
  std::vector<Vector2> displacements_m;         ///< at each step after t0
};

/// All windows of the tracks so far. Other places are laid over the first one by their curb frames.
struct TrackMemory {
  CurbFrame frame;
  std::vector<RememberedWindow> windows;
};

/// The memory with the windows of more tracks; only windows with their whole future are kept.
/// Throws: std::invalid_argument for a configuration out of range.
TrackMemory remember(TrackMemory memory, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                     const MemoryConfig& memory_config);

/// What became of the nearest remembered windows, each a mode; the nearer the heavier. Constant velocity, flagged as a
/// fallback, from an empty memory. Shapes: `steps` steps of `interval_s`.
Prediction predict(const TrackMemory& memory, const CurbTrajectory& observed, int steps, double interval_s,
                   const MemoryConfig& config);

}  // namespace sila
