// One episode of 20 tracks, and opening a model, on the simulated intersection or on a scene of real tracks.
//
//   pipeline                                     # simulated
//   SILA_BENCH_SCENE=SCENE.json SILA_BENCH_DATA=DIR pipeline
//
// One thread, so that a figure is a cost and not a number of cores.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "place.hpp"
#include "sila/predict/predictor.hpp"

namespace {

void Episode(benchmark::State& state, bool lessons) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  sila::EpisodeConfig config = bench::kConfig.episode;
  config.lessons.enabled = lessons;
  std::size_t number = 0;
  bench::place();  // learnt before the clock starts
  for (auto _ : state) {
    benchmark::DoNotOptimize(sila::run_episode(bench::place().model, bench::place().batch(number++), config));
  }
  state.counters["model size"] = static_cast<double>(size(bench::place().model));
}

void OpenModel(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(sila::Predictor(bench::place().model, bench::kConfig.episode.predict));
}

BENCHMARK_CAPTURE(Episode, learn and fuse, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Episode, with lessons, true)->Unit(benchmark::kMillisecond);
BENCHMARK(OpenModel)->Unit(benchmark::kMillisecond);

}  // namespace
