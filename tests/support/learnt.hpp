#pragma once

// Made-up walks, learnt.

#include <algorithm>
#include <span>
#include <vector>

#include "sila/train/episode.hpp"
#include "sila/train/fleet.hpp"
#include "support/walks.hpp"

namespace sila::testing {

/// `start` after the tracks, in batches of 20.
inline Model learnt(std::span<const FramedTrajectory> tracks, const Model& start, const EpisodeConfig& config = {}) {
  return run_episodes(start, tracks, 20, config, sila_update(config)).model;
}

inline Model learnt(std::span<const FramedTrajectory> tracks, const EpisodeConfig& config = {}) {
  return learnt(tracks, Model{}, config);
}

inline const Model& corner_model() {
  static const Model model = learnt(corner_walks(80, 21));
  return model;
}

/// The partitions of a fleet, in the order of the tracks.
inline std::vector<Partition> partitions_of(std::span<const FramedTrajectory> tracks, std::size_t partition,
                                            std::size_t batch) {
  std::vector<Partition> partitions;
  for (std::size_t i = 0; i < tracks.size(); i += partition) {
    const auto part = tracks.subspan(i, std::min(partition, tracks.size() - i));
    partitions.push_back({{part.begin(), part.end()}, batch, {}, {}});
  }
  return partitions;
}

}  // namespace sila::testing
