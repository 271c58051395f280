// One prediction and a frame of 100, idle and while episodes are learnt on another core. Each call is timed by itself,
// for it is the slow ones that a control loop notices: counters p50, p99 and worst [us].
//
//   prediction                                   # simulated
//   SILA_BENCH_SCENE=SCENE.json SILA_BENCH_DATA=DIR prediction
//   SILA_BENCH_MODEL=M.sila prediction           # and of a model that `sila learn` made of the simulated crossing

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "place.hpp"
#include "sila/io/model_file.hpp"
#include "sila/refine/predictor.hpp"

namespace {

using Clock = std::chrono::steady_clock;

std::vector<sila::Window> simulated_windows() {
  return sila::windows_of(bench::simulated_tracks(60, 77), bench::kConfig.episode.sampling,
                          bench::kConfig.episode.predict, 1.0);
}

void report(benchmark::State& state, std::vector<double>& each_us, const sila::Model& model) {
  std::sort(each_us.begin(), each_us.end());
  const auto quantile = [&](double share) {
    return each_us[static_cast<std::size_t>(share * static_cast<double>(each_us.size() - 1))];
  };
  state.counters["p50"] = quantile(0.5);
  state.counters["p99"] = quantile(0.99);
  state.counters["worst"] = quantile(1.0);
  state.counters["primitives"] = static_cast<double>(model.primitives.size());
  state.counters["transitions"] = static_cast<double>(model.transitions.size());
}

/// Predictions of so many windows are one call.
void predict(benchmark::State& state, const sila::Model& model, const std::vector<sila::Window>& windows,
             std::size_t at_once) {
  const sila::Predictor predictor(model, bench::kConfig.episode.predict);
  sila::Workspace workspace;
  for (const sila::Window& window : windows) predictor.predict(window.observed, workspace);
  std::vector<double> each_us;
  each_us.reserve(std::size_t{1} << 22);
  std::size_t number = 0;
  for (auto _ : state) {
    const auto start = Clock::now();
    for (std::size_t k = 0; k < at_once; ++k)
      benchmark::DoNotOptimize(predictor.predict(windows[number++ % windows.size()].observed, workspace));
    each_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  report(state, each_us, model);
}

void OneAtThePlace(benchmark::State& state) {
  predict(state, bench::place().model, bench::place().windows, 1);
}

void OneOfALargeModel(benchmark::State& state) {
  static const std::vector<sila::Window> windows = simulated_windows();
  predict(state, bench::large_model(), windows, 1);
}

void FrameOf100(benchmark::State& state) {
  static const std::vector<sila::Window> windows = simulated_windows();
  predict(state, bench::large_model(), windows, 100);
}

/// The simulated people asked of the model in a file, one at a time or so many at once.
void OfAModelFile(benchmark::State& state, std::size_t at_once) {
  const char* path = std::getenv("SILA_BENCH_MODEL");
  if (!path) return state.SkipWithError("SILA_BENCH_MODEL names no file");
  predict(state, sila::load_model(path).model, simulated_windows(), at_once);
}

void OneWhileLearning(benchmark::State& state) {
  std::atomic<bool> done = false;
  bench::place();
  std::thread learner([&] {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    for (std::size_t number = 0; !done; ++number)
      benchmark::DoNotOptimize(
          sila::run_episode(bench::place().model, bench::place().batch(number), bench::kConfig.episode));
  });
  predict(state, bench::place().model, bench::place().windows, 1);
  done = true;
  learner.join();
}

BENCHMARK(OneAtThePlace)->Unit(benchmark::kMicrosecond)->Repetitions(3);
BENCHMARK(OneWhileLearning)->Unit(benchmark::kMicrosecond)->Repetitions(3);
BENCHMARK(OneOfALargeModel)->Unit(benchmark::kMicrosecond)->Repetitions(3);
BENCHMARK(FrameOf100)->Unit(benchmark::kMicrosecond)->Repetitions(3);
BENCHMARK_CAPTURE(OfAModelFile, one, 1)->Unit(benchmark::kMicrosecond)->Repetitions(3);
BENCHMARK_CAPTURE(OfAModelFile, frame of 100, 100)->Unit(benchmark::kMicrosecond)->Repetitions(3);

}  // namespace
