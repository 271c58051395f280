#include "sila/learn/transitions.hpp"

namespace sila {
namespace {

/// Stretches of tracks, [begin, end), that belong to one transition.
struct Stretch {
  std::size_t track = 0, begin = 0, end = 0;
};

TransitionSamples gather(std::span<const CurbTrajectory> tracks, const std::vector<Stretch>& stretches) {
  std::size_t count = 0;
  for (const Stretch& stretch : stretches) count += stretch.end - stretch.begin;
  const auto rows = static_cast<Eigen::Index>(count);
  TransitionSamples samples{Eigen::MatrixXd(2, rows), Eigen::MatrixXd(rows, 2)};
  Eigen::Index row = 0;
  for (const Stretch& stretch : stretches) {
    for (std::size_t t = stretch.begin; t < stretch.end; ++t, ++row) {
      samples.positions.col(row) = tracks[stretch.track].positions[t];
      samples.velocities.row(row) = tracks[stretch.track].velocities[t].transpose();
    }
  }
  return samples;
}

}  // namespace

std::map<TransitionKey, ObservedTransition> observe_transitions(std::span<const CurbTrajectory> tracks,
                                                                std::span<const std::vector<Segment>> segments) {
  std::map<TransitionKey, std::vector<Stretch>> stretches;
  std::map<TransitionKey, double> counts;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::vector<Segment>& runs = segments[i];
    std::map<TransitionKey, std::size_t> last_end;  // of this track: a pair seen twice must not give a sample twice
    const auto note = [&](const Segment& from, const Segment& to) {
      const TransitionKey key{from.primitive, to.primitive};
      const auto [seen, first] = last_end.try_emplace(key, from.begin);
      if (first) counts[key] += 1.0;
      stretches[key].push_back({i, std::max(from.begin, seen->second), to.end});
      seen->second = to.end;
    };
    if (runs.size() == 1) note(runs.front(), runs.front());
    for (std::size_t r = 1; r < runs.size(); ++r) note(runs[r - 1], runs[r]);
  }
  std::map<TransitionKey, ObservedTransition> observed;
  for (const auto& [key, list] : stretches) observed[key] = {counts[key], gather(tracks, list)};
  return observed;
}

}  // namespace sila
