#include "sila/learn/transitions.hpp"

#include <algorithm>

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

/// The transition under way at a sample: that to the segment which follows.
TransitionKey transition_at(const std::vector<Segment>& runs, std::size_t sample) {
  std::size_t r = 0;
  while (r + 1 < runs.size() && sample >= runs[r].end) ++r;
  if (r + 1 < runs.size()) return {runs[r].primitive, runs[r + 1].primitive};
  return {runs[r > 0 ? r - 1 : r].primitive, runs[r].primitive};
}

/// The sample of a track at a time.
std::size_t sample_at(const CurbTrajectory& track, double time_s) {
  const auto later = std::lower_bound(track.times_s.begin(), track.times_s.end(), time_s - 1e-9);
  return std::min(static_cast<std::size_t>(later - track.times_s.begin()), track.times_s.size() - 1);
}

OutlookSamples stacked(const std::vector<const OutlookExample*>& examples) {
  const auto count = static_cast<Eigen::Index>(examples.size());
  OutlookSamples samples{Eigen::MatrixXd(kOutlookInputs, count),
                         Eigen::MatrixXd(count, examples.front()->partings.size())};
  for (Eigen::Index i = 0; i < count; ++i) {
    samples.states.col(i) = examples[static_cast<std::size_t>(i)]->state;
    samples.partings.row(i) = examples[static_cast<std::size_t>(i)]->partings.transpose();
  }
  return samples;
}

}  // namespace

std::map<TransitionKey, OutlookSamples> observe_outlooks(const Batch& batch,
                                                         std::span<const std::vector<Segment>> segments) {
  std::map<TransitionKey, std::vector<const OutlookExample*>> examples;
  for (std::size_t i = 0; i < batch.outlooks.size(); ++i) {
    if (segments[i].empty()) continue;
    for (const OutlookExample& example : batch.outlooks[i])
      examples[transition_at(segments[i], sample_at(batch.tracks[i], example.t0_s))].push_back(&example);
  }
  std::map<TransitionKey, OutlookSamples> samples;
  for (const auto& [key, list] : examples) samples[key] = stacked(list);
  return samples;
}

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
