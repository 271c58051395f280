#pragma once

#include <cstdlib>
#include <span>
#include <vector>

#include "sila/config.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"

namespace bench {

inline const sila::Config kConfig;
inline constexpr std::size_t kBatch = 20;

inline std::vector<sila::FramedTrajectory> simulated_tracks(int count, std::uint64_t seed = kConfig.simulate.seed) {
  sila::SimulationConfig config = kConfig.simulate;
  config.tracks = count;
  config.seed = seed;
  sila::Simulation simulation = sila::simulate(config);
  std::vector<sila::FramedTrajectory> tracks;
  for (sila::Trajectory& track : simulation.tracks)
    tracks.push_back({std::move(track), sila::primary_corner(simulation.scene).frame});
  return tracks;
}

/// Of the scene that SILA_BENCH_SCENE and SILA_BENCH_DATA name, else simulated.
inline std::vector<sila::FramedTrajectory> all_tracks() {
  if (const char* path = std::getenv("SILA_BENCH_SCENE")) {
    const char* data = std::getenv("SILA_BENCH_DATA");
    const sila::Scene scene = sila::read_scene(path, data ? data : "");
    std::vector<sila::FramedTrajectory> tracks;
    for (sila::Trajectory& track : sila::read_tracks({}, scene, {}, kConfig.clean).trajectories) {
      tracks.push_back({std::move(track), scene.corners[scene.primary].frame});
    }
    return sila::split_tracks(std::move(tracks), 0.0, 1, sila::SplitBy::track).train;
  }
  return simulated_tracks(400);
}

/// A place half learnt, and the next batches.
struct Place {
  std::vector<sila::FramedTrajectory> tracks = all_tracks();
  std::size_t half = tracks.size() / 2 / kBatch * kBatch;
  sila::Model model =
      sila::run_episodes({}, std::span(tracks).first(half), kBatch, kConfig.episode, sila::sila_update(kConfig.episode))
          .model;
  std::vector<sila::Window> windows =
      sila::windows_of(std::span(tracks).subspan(half), kConfig.episode.sampling, kConfig.episode.predict, 1.0);

  std::span<const sila::FramedTrajectory> batch(std::size_t number) const {
    const std::size_t batches = (tracks.size() - half) / kBatch;
    return std::span(tracks).subspan(half + number % batches * kBatch, kBatch);
  }
};

inline const Place& place() {
  static const Place it;
  return it;
}

/// A model of at least 1000 transitions: nothing is fused, so that more fields overlap than in a model that SILA made.
inline const sila::Model& large_model() {
  static const sila::Model model = [] {
    const std::vector<sila::FramedTrajectory> tracks = simulated_tracks(4000);
    sila::Model grown;
    const sila::Update update = sila::accumulate_update(kConfig.episode);
    for (std::size_t first = 0; grown.transitions.size() < 1000; first += kBatch)
      grown = sila::run_episode(grown, std::span(tracks).subspan(first, kBatch), kConfig.episode, update).model;
    return grown;
  }();
  return model;
}

}  // namespace bench
