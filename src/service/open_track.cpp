#include "open_track.hpp"

#include <algorithm>

namespace sila {
namespace {

CleanTracks cleaned(std::vector<Detection> rows, const CleanConfig& config) {
  Detections source{"stream", std::move(rows), 0};
  source.rows_read = source.rows.size();
  return clean(std::span(&source, 1), config);
}

/// Whether a row continues the path from the newest row: `clean` makes one trajectory of the last two samples, whose
/// interval decides how long a gap may be, and the row.
bool continues(const OpenTrack& track, const Detection& row, const CleanConfig& config) {
  if (track.path.times_s.empty() || track.path.times_s.back() != track.latest_s || row.t_s <= track.latest_s)
    return false;
  std::vector<Detection> rows;
  const std::size_t samples = track.path.times_s.size();
  for (std::size_t i = samples - std::min<std::size_t>(2, samples); i < samples; ++i)
    rows.push_back({row.track, track.path.times_s[i], track.path.positions_m[i]});
  rows.push_back(row);
  const CleanTracks tracks = cleaned(rows, config);
  return tracks.trajectories.size() == 1 && tracks.trajectories.front().times_s.size() == rows.size();
}

}  // namespace

bool is_usable(const Detection& row, const CleanConfig& config) {
  const TrackReport report = cleaned({row}, config).report;
  return report.dropped.size() == 1 && report.dropped.front().reason == DropReason::single_sample;
}

bool extend(OpenTrack& track, const Detection& row, const CleanConfig& config) {
  if (!track.rows.empty() && row.t_s == track.rows.back().t_s && row.position_m == track.rows.back().position_m)
    return false;
  const bool in_order = continues(track, row, config);
  track.rows.push_back(row);
  track.latest_s = track.rows.size() == 1 ? row.t_s : std::max(track.latest_s, row.t_s);
  if (in_order) {
    track.path.times_s.push_back(row.t_s);
    track.path.positions_m.push_back(row.position_m);
    return true;
  }
  std::vector<Trajectory> trajectories = trajectories_of(track, config);
  track.path = trajectories.empty() ? Trajectory{row.track, {}, {}} : std::move(trajectories.back());
  return !track.path.times_s.empty() && track.path.times_s.back() == row.t_s;
}

std::vector<Trajectory> trajectories_of(const OpenTrack& track, const CleanConfig& config) {
  return cleaned(track.rows, config).trajectories;
}

}  // namespace sila
