#include "open_track.hpp"

#include <algorithm>

#include "core/track_cuts.hpp"

namespace sila {
namespace {

CleanTracks cleaned(std::vector<Detection> rows, const CleanConfig& config) {
  Detections source{"stream", std::move(rows), 0};
  source.rows_read = source.rows.size();
  return clean(std::span(&source, 1), config);
}

/// Whether `clean` would append a row to the path.
bool continues(const OpenTrack& track, const Detection& row, const CleanConfig& config) {
  if (track.path.times_s.empty() || track.path.times_s.back() != track.latest_s) return false;
  const double passed_s = row.t_s - track.latest_s;
  return passed_s >= kSlack_s && passed_s <= longest_gap_s(track, config) &&
         !is_jump(row.position_m - track.path.positions_m.back(), passed_s, config);
}

}  // namespace

double longest_gap_s(const OpenTrack& track, const CleanConfig& config) {
  const std::vector<double>& times_s = track.path.times_s;
  const double interval_s = times_s.size() > 1 ? times_s.back() - times_s[times_s.size() - 2] : config.max_gap_s;
  return longest_gap_s(interval_s, config);
}

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
