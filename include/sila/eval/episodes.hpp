#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sila/episode/episode.hpp"

namespace sila {

/// Whose track it is: pieces of one person are "17", "17#2", ...
std::string person_of(const std::string& track_id);

/// Tracks to learn from, in the order of their arrival, and tracks held back.
struct Split {
  std::vector<PlacedTrack> train;
  std::vector<PlacedTrack> test;
};

/// Shuffles tracks by seed and holds back a share of them. By track, never by window: the pieces of a track that was
/// cut at a gap
/// ("17", "17#2") stay on one side. The same seed gives the same split on every machine.
/// Throws: std::invalid_argument if test_share is outside [0, 1).
Split split_tracks(std::vector<PlacedTrack> tracks, double test_share, std::uint64_t seed);

/// A run of episodes: the last model and what each episode did.
struct Run {
  Model model;
  std::vector<EpisodeReport> episodes;  ///< of the batches that were learnt
  int known = 0;                        ///< batches that the model had learnt before
};

/// Called after each episode that learnt something with its number, from 1.
using EpisodeObserver = std::function<void(int, const Episode&)>;

/// The next batch; empty after the last. What the span points to stays until the next call.
using BatchSource = std::function<std::span<const PlacedTrack>()>;

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
Run run_episodes(const Model& start, std::span<const PlacedTrack> tracks, std::size_t batch_size,
                 const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer = {});

/// The batch-learning baseline: all tracks at once. Its lessons come from models of one half predicting the other half,
/// so that no window teaches that was learnt.
Run learn_at_once(std::span<const PlacedTrack> tracks, const EpisodeConfig& config);

}  // namespace sila
