#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// The last model and what each episode did.
struct Training {
  Model model;
  std::vector<EpisodeReport> episodes;  ///< of the batches that were learnt
  int known = 0;                        ///< batches that the model had learnt before
};

/// Called after each episode that learnt a batch: its number, from 1, the model before it, and the episode.
using EpisodeObserver = std::function<void(int, const Model& previous, const Episode&)>;

/// The next batch; empty after the last. What the span points to stays until the next call.
using BatchSource = std::function<std::span<const FramedTrajectory>()>;

struct BatchesResult {
  Model model;
  int learnt = 0;  ///< batches
  int known = 0;   ///< batches that the model had learnt before
};

/// Learns batch after batch: SILA and every baseline, a stream and tracks in memory go through this one loop.
BatchesResult run_batches(Model start, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                          const EpisodeObserver& observer = {});

/// Feeds tracks to `update`, `batch_size` at a time.
Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer = {});

/// The batch-learning baseline: all tracks at once, nothing pruned as nothing grows.
Training train_batch(std::span<const FramedTrajectory> tracks, const EpisodeConfig& config);

}  // namespace sila
