#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// A run of episodes: the last model and what each episode did.
struct Training {
  Model model;
  std::vector<EpisodeReport> episodes;  ///< of the batches that were learnt
  int known = 0;                        ///< batches that the model had learnt before
};

/// Called after each episode that learnt something with its number, from 1.
using EpisodeObserver = std::function<void(int, const Episode&)>;

/// The next batch; empty after the last. What the span points to stays until the next call.
using BatchSource = std::function<std::span<const FramedTrajectory>()>;

/// Batches that were learnt, and those that the model had learnt before.
struct BatchCounts {
  int learnt = 0;
  int known = 0;
};

/// Learns batch after batch into `model`: SILA and every baseline, a stream and what is in memory go through this one
/// loop. If it throws, `model` is what the last whole episode left.
BatchCounts run_batches(Model& model, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                        const EpisodeObserver& observer = {});

/// Feeds tracks to `update`, `batch_size` at a time.
Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer = {});

/// The batch-learning baseline: all tracks at once. Its error statistics come from models of one half predicting the
/// other half, so that no window teaches that was learnt.
Training train_batch(std::span<const FramedTrajectory> tracks, const EpisodeConfig& config);

}  // namespace sila
