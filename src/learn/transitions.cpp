#include <algorithm>
#include <cmath>
#include <set>

#include "learn/steps.hpp"

namespace sila {
namespace {

/// Stretches of tracks, [begin, end), that belong to one transition.
struct Stretch {
  std::size_t track = 0, begin = 0, end = 0;
};

std::size_t samples_in(double stride_s, const CurbTrajectory& track) {
  if (track.times_s.size() < 2) return 1;
  return static_cast<std::size_t>(std::max(1L, std::lround(stride_s / (track.times_s[1] - track.times_s[0]))));
}

/// The samples of stretches, of which none is empty. Of each stretch one every `stride_s`, the first half of that after
/// the start; of one shorter than `stride_s` the middle sample.
GpData gather(std::span<const CurbTrajectory> tracks, const std::vector<Stretch>& stretches, double stride_s) {
  std::vector<Vector2> positions, velocities;
  for (const auto& [number, begin, end] : stretches) {
    const CurbTrajectory& track = tracks[number];
    const std::size_t stride = samples_in(stride_s, track);
    for (std::size_t t = begin + std::min(stride / 2, (end - begin - 1) / 2); t < end; t += stride) {
      positions.push_back(track.positions[t]);
      velocities.push_back(track.velocities[t]);
    }
  }
  const auto count = static_cast<Eigen::Index>(positions.size());
  return {Eigen::Matrix2Xd::Map(positions.front().data(), 2, count),
          Eigen::Matrix2Xd::Map(velocities.front().data(), 2, count).transpose()};
}

}  // namespace

ObservedTransitions observe_transitions(std::span<const CurbTrajectory> tracks,
                                        std::span<const std::vector<Segment>> segments, std::span<const int> sites,
                                        double stride_s) {
  ObservedTransitions observed;
  std::map<TransitionKey, std::vector<Stretch>> stretches;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::vector<Segment>& runs = segments[i];
    std::set<TransitionKey> seen;  // on this track; stretches of one transition share no sample, as neighbours differ
    const auto add = [&](const Segment& from, const Segment& to) {
      const TransitionKey key{from.primitive, to.primitive};
      if (seen.insert(key).second) add_count(observed[key].sites, {sites[i], 1.0, 1});
      stretches[key].push_back({i, from.begin, to.end});
    };
    if (runs.size() == 1) add(runs.front(), runs.front());
    for (std::size_t r = 1; r < runs.size(); ++r) add(runs[r - 1], runs[r]);
  }
  for (const auto& [key, list] : stretches) observed[key].samples = gather(tracks, list, stride_s);
  return observed;
}

}  // namespace sila
