// What tools/check_instructions counts: the same predictions and the same episode each time, on one thread. A count of
// instructions does not depend on what else the machine does.
//
//   bench_instructions       prints how many predictions it makes

#include <tbb/global_control.h>

#include <iostream>

#include "place.hpp"
#include "sila/refine/predictor.hpp"

// Their names are what the count is switched on and off by.
extern "C" {
[[gnu::noinline]] void sila_counted_predictions(const sila::Predictor& predictor,
                                                const std::vector<sila::Window>& windows, sila::Workspace& workspace) {
  for (const sila::Window& window : windows) predictor.predict(window.observed, workspace);
}

[[gnu::noinline]] std::size_t sila_counted_episode(const sila::Model& model,
                                                   std::span<const sila::FramedTrajectory> batch) {
  return size(sila::run_episode(model, batch, bench::kConfig.episode).model);
}
}

int main() {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<sila::FramedTrajectory> tracks = bench::simulated_tracks(3 * static_cast<int>(bench::kBatch));
  const std::span<const sila::FramedTrajectory> seen = std::span(tracks).first(2 * bench::kBatch);
  const std::span<const sila::FramedTrajectory> batch = std::span(tracks).last(bench::kBatch);
  const sila::EpisodeConfig& config = bench::kConfig.episode;
  const sila::Model model = sila::run_episodes({}, seen, bench::kBatch, config, sila::sila_update(config)).model;
  const std::vector<sila::Window> windows = sila::windows_of(batch, config.sampling, config.predict, 4.0);
  const sila::Predictor predictor(model, config.predict);
  sila::Workspace workspace;
  for (const sila::Window& window : windows) predictor.predict(window.observed, workspace);
  sila_counted_predictions(predictor, windows, workspace);
  const std::size_t size = sila_counted_episode(model, batch);
  std::cout << windows.size() << "\n";
  return size > 0 ? 0 : 1;
}
