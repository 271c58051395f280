#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sila/train/episode.hpp"

namespace sila {

Training run_batches(Model start, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                     const EpisodeObserver& observer) {
  Training result;
  std::optional<Model> model(std::move(start));  // none: it is in the snapshot
  std::unique_ptr<Snapshot> snapshot;
  for (std::span<const FramedTrajectory> batch = next_batch(); !batch.empty(); batch = next_batch()) {
    const auto started = std::chrono::steady_clock::now();
    if (model && config.error_statistics.enabled && model->episodes > 0) {  // error statistics need its predictor
      Model present = *std::exchange(model, std::nullopt);
      snapshot = std::make_unique<Snapshot>(std::move(present), config.predict, snapshot.get());
    }
    const std::chrono::duration<double> snapshot_time = std::chrono::steady_clock::now() - started;
    Episode episode = model ? run_episode(*model, batch, config, update)
                            : run_episode(snapshot->model, batch, config, update, &snapshot->predictor);
    episode.report.seconds += snapshot_time.count();
    if (episode.report.known) {
      ++result.known;
      continue;
    }
    result.episodes.push_back(episode.report);
    if (observer) observer(static_cast<int>(result.episodes.size()), model ? *model : snapshot->model, episode);
    model = std::move(episode.model);
  }
  result.model = std::move(model ? *model : snapshot->model);
  return result;
}

Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer) {
  if (batch_size == 0) throw std::invalid_argument("run_episodes: batch_size = 0, must be at least 1");
  const auto next_batch = [&, left = tracks]() mutable {
    const auto batch = left.first(std::min(batch_size, left.size()));
    left = left.subspan(batch.size());
    return batch;
  };
  return run_batches(start, next_batch, config, update, observer);
}

}  // namespace sila
