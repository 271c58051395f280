// One episode of 20 tracks and one prediction, on the simulated intersection or on a scene of real tracks.
//
//   pipeline                                     # simulated
//   SILA_BENCH_SCENE=SCENE.json SILA_BENCH_DATA=DIR pipeline
//
// One thread, so that a figure is a cost and not a number of cores.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cstdlib>

#include "sila/config.hpp"
#include "sila/eval/episodes.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/predict/predictor.hpp"
#include "sila/sim/simulate.hpp"

namespace {

const sila::Config kConfig;
constexpr std::size_t kBatch = 20;

std::vector<sila::PlacedTrack> all_tracks() {
  std::vector<sila::PlacedTrack> tracks;
  if (const char* path = std::getenv("SILA_BENCH_SCENE")) {
    const char* data = std::getenv("SILA_BENCH_DATA");
    const sila::Scene scene = sila::read_scene(path, kConfig.episode.scaling, data ? data : "");
    for (sila::Trajectory& track : sila::read_scene_tracks(scene, kConfig.clean).trajectories) {
      tracks.push_back({std::move(track), scene.corners[scene.primary].frame});
    }
    return sila::split_tracks(std::move(tracks), 0.0, 1).train;
  }
  sila::SimulationConfig simulation = kConfig.simulate;
  simulation.tracks = 400;
  sila::Simulation simulated = sila::simulate(simulation);
  for (sila::Trajectory& track : simulated.tracks) {
    tracks.push_back({std::move(track), sila::primary_corner(simulated.scene).frame});
  }
  return tracks;
}

/// A place half learnt, and the next batches.
struct Place {
  std::vector<sila::PlacedTrack> tracks = all_tracks();
  std::size_t half = tracks.size() / 2 / kBatch * kBatch;
  sila::Model model =
      sila::run_episodes({}, std::span(tracks).first(half), kBatch, kConfig.episode, sila::sila_update(kConfig.episode))
          .model;
  std::vector<sila::Window> windows =
      sila::windows_of(std::span(tracks).subspan(half), kConfig.episode.sampling, kConfig.episode.predict, 1.0);

  std::span<const sila::PlacedTrack> batch(std::size_t number) const {
    const std::size_t batches = (tracks.size() - half) / kBatch;
    return std::span(tracks).subspan(half + number % batches * kBatch, kBatch);
  }
};

const Place& place() {
  static const Place it;
  return it;
}

void Episode(benchmark::State& state, bool lessons) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  sila::EpisodeConfig config = kConfig.episode;
  config.lessons.enabled = lessons;
  std::size_t number = 0;
  place();  // learnt before the clock starts
  for (auto _ : state) {
    benchmark::DoNotOptimize(sila::run_episode(place().model, place().batch(number++), config));
  }
  state.counters["model size"] = static_cast<double>(size(place().model));
}

void OnePrediction(benchmark::State& state) {
  const sila::Predictor predictor(place().model, kConfig.episode.predict);
  sila::Workspace workspace;
  std::size_t number = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(predictor.predict(place().windows[number++ % place().windows.size()].observed, workspace));
  }
  state.counters["model size"] = static_cast<double>(size(place().model));
}

void OpenModel(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(sila::Predictor(place().model, kConfig.episode.predict));
}

BENCHMARK_CAPTURE(Episode, learn and fuse, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Episode, with lessons, true)->Unit(benchmark::kMillisecond);
BENCHMARK(OnePrediction)->Unit(benchmark::kMicrosecond);
BENCHMARK(OpenModel)->Unit(benchmark::kMillisecond);

}  // namespace
