#include "learn/transitions.hpp"

#include <algorithm>
#include <cmath>

namespace sila {
namespace {

/// Stretches of tracks, [begin, end), that belong to one transition.
struct Stretch {
  std::size_t track = 0, begin = 0, end = 0;
};

/// A sample of a track.
struct SampleOf {
  std::size_t track = 0, sample = 0;
};

std::size_t samples_in(double stride_s, const CurbTrajectory& track) {
  if (track.times_s.size() < 2) return 1;
  return static_cast<std::size_t>(std::max(1L, std::lround(stride_s / (track.times_s[1] - track.times_s[0]))));
}

/// Subsamples each stretch: one sample every `stride_s`, the first half of that after the start; of a stretch shorter
/// than `stride_s` the middle sample.
std::vector<SampleOf> subsampled(std::span<const CurbTrajectory> tracks, const std::vector<Stretch>& stretches,
                                 double stride_s) {
  std::vector<SampleOf> samples;
  for (const Stretch& stretch : stretches) {
    if (stretch.begin == stretch.end) continue;
    const std::size_t stride = samples_in(stride_s, tracks[stretch.track]);
    const std::size_t first = stretch.begin + std::min(stride / 2, (stretch.end - stretch.begin - 1) / 2);
    for (std::size_t t = first; t < stretch.end; t += stride) samples.push_back({stretch.track, t});
  }
  return samples;
}

GpData gather(std::span<const CurbTrajectory> tracks, const std::vector<SampleOf>& chosen) {
  const auto rows = static_cast<Eigen::Index>(chosen.size());
  GpData samples{Eigen::MatrixXd(2, rows), Eigen::MatrixXd(rows, 2)};
  Eigen::Index row = 0;
  for (const auto& [track, t] : chosen) {
    samples.inputs.col(row) = tracks[track].positions[t];
    samples.outputs.row(row++) = tracks[track].velocities[t].transpose();
  }
  return samples;
}

}  // namespace

std::map<TransitionKey, ObservedTransition> observe_transitions(std::span<const CurbTrajectory> tracks,
                                                                std::span<const std::vector<Segment>> segments,
                                                                std::span<const int> sites, double stride_s) {
  std::map<TransitionKey, std::vector<Stretch>> stretches;
  std::map<TransitionKey, std::vector<SiteCount>> counts;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::vector<Segment>& runs = segments[i];
    std::map<TransitionKey, std::size_t> last_end;  // of this track: a pair seen twice must not give a sample twice
    const auto add = [&](const Segment& from, const Segment& to) {
      const TransitionKey key{from.primitive, to.primitive};
      const auto [seen, first] = last_end.try_emplace(key, from.begin);
      if (first) add_count(counts[key], {sites[i], 1.0, 1});
      stretches[key].push_back({i, std::max(from.begin, seen->second), to.end});
      seen->second = to.end;
    };
    if (runs.size() == 1) add(runs.front(), runs.front());
    for (std::size_t r = 1; r < runs.size(); ++r) add(runs[r - 1], runs[r]);
  }
  std::map<TransitionKey, ObservedTransition> observed;
  for (const auto& [key, list] : stretches)
    observed[key] = {counts[key], gather(tracks, subsampled(tracks, list, stride_s))};
  return observed;
}

}  // namespace sila
