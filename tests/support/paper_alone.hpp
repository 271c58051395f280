#pragma once

// The paper's verbs alone: no refinement.

#include <algorithm>
#include <span>
#include <vector>

#include "predict/predict.hpp"
#include "sila/core/sampling.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"
#include "support/walks.hpp"

namespace sila::testing {

/// The model of batches of 20 tracks, learnt and fused one after another.
inline Model learn_paper_alone(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const LearnConfig& learning, const FuseConfig& fusing) {
  constexpr std::size_t kBatch = 20;
  const ModelSettings settings = begin_settings(tracks.front().frame.sidewalk_width_m, CurbScaling::mean_width,
                                                sampling.interval_s, learning.grid);
  Model model;
  for (std::size_t begin = 0; begin < tracks.size(); begin += kBatch) {
    std::vector<CurbTrajectory> batch;
    for (const FramedTrajectory& track : tracks.subspan(begin, std::min(kBatch, tracks.size() - begin)))
      batch.push_back(resample(track.track, track.frame, sampling));
    model = fuse(model, learn(batch, settings, learning).increment, fusing).model;
  }
  return model;
}

/// `corner_walks` in widths.
inline std::vector<FramedTrajectory> walks_in_widths(int count, unsigned seed) {
  std::vector<FramedTrajectory> tracks = corner_walks(count, seed);
  for (FramedTrajectory& track : tracks) track.frame = square_frame(2.5, CurbScaling::mean_width);
  return tracks;
}

}  // namespace sila::testing
