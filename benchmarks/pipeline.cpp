// One episode of 20 tracks, and opening a model, on the simulated intersection or on a scene of real tracks; and
// reading a track file.
//
//   pipeline                                     # simulated
//   SILA_BENCH_SCENE=SCENE.json SILA_BENCH_DATA=DIR pipeline
//   SILA_BENCH_TRACKS=FILE pipeline              # and reads this file
//
// One thread, so that a figure is a cost and not a number of cores, where nothing else is said.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "place.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/track_files.hpp"
#include "sila/refine/predictor.hpp"

namespace {

void Episode(benchmark::State& state, bool error_statistics) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  sila::EpisodeConfig config = bench::kConfig.episode;
  config.error_statistics.enabled = error_statistics;
  std::size_t number = 0;
  bench::place();  // learnt before the clock starts
  for (auto _ : state) {
    benchmark::DoNotOptimize(sila::run_episode(bench::place().model, bench::place().batch(number++), config));
  }
  state.counters["model size"] = static_cast<double>(size(bench::place().model));
}

/// Read from its file, and made ready to predict.
void OpenModel(benchmark::State& state, const sila::Model& (*made)(), std::size_t threads) {
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, threads);
  const std::string path = (std::filesystem::temp_directory_path() / "sila-bench-open.sila").string();
  std::filesystem::remove(path);
  sila::save_model(path, {made(), "{}", {}, "", 0});
  for (auto _ : state)
    benchmark::DoNotOptimize(sila::Predictor(sila::load_model(path).model, bench::kConfig.episode.predict));
  state.counters["transitions"] = static_cast<double>(made().transitions.size());
  std::filesystem::remove(path);
}

const sila::Model& model_of_the_place() {
  return bench::place().model;
}

void ReadTracks(benchmark::State& state) {
  const char* path = std::getenv("SILA_BENCH_TRACKS");
  if (!path) return state.SkipWithError("SILA_BENCH_TRACKS names no file");
  for (auto _ : state) benchmark::DoNotOptimize(sila::read_detections(path));
}

BENCHMARK_CAPTURE(Episode, learn and fuse, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Episode, with error_statistics, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OpenModel, one thread, model_of_the_place, 1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OpenModel, nothing fused one thread, bench::large_model, 1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OpenModel, nothing fused two threads, bench::large_model, 2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(ReadTracks)->Unit(benchmark::kMillisecond);

}  // namespace
