#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sila/core/detections.hpp"
#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// How rows become trajectories.
struct CleanConfig {
  double max_gap_s = 1.0;
  static constexpr double largest_max_gap_s = 60.0;
  double max_speed_mps = 12.0;
  /// Noise that is allowed on top of max_speed_mps, and between samples of the same time stamp [m].
  static constexpr double jump_tolerance_m = 0.5;
  /// Coordinates beyond this are dropped as faulty [m]. Those of maps (UTM, Web Mercator) are smaller; the finest grid
  /// reaches farther.
  static constexpr double max_abs_position_m = 3e7;
  /// Tracks of a smaller extent are counted as standing (and kept) [m].
  static constexpr double standing_extent_m = 0.5;
  bool pedestrians_only = true;
};

void fields(MaybeConst<CleanConfig> auto& config, auto&& visit) {
  visit.number("max_gap_s", config.max_gap_s, Range{0.0, CleanConfig::largest_max_gap_s, true}, "s",
               "a gap longer than this, plus a fifth of the interval before it (at most of this), splits a track");
  visit.number("max_speed_mps", config.max_speed_mps, Range{0.0, 100.0, true}, "m/s",
               "a faster jump is a re-used id (the track is split) or an outlier (the sample is dropped)");
  visit.flag("pedestrians_only", config.pedestrians_only, "drop rows whose class label is not that of a pedestrian");
}

/// Counts of all rows. Invariant: `rows_read` = `rows_kept` + the rows of `dropped`.
struct TrackReport {
  std::size_t sources = 0;
  std::size_t rows_read = 0;
  std::size_t rows_kept = 0;
  std::vector<DroppedRows> dropped;   ///< by reason, in the order of `DropReason`
  std::size_t track_ids = 0;          ///< ids that had a usable row
  std::size_t tracks_kept = 0;        ///< trajectories made
  std::size_t out_of_order_rows = 0;  ///< earlier than the row before them; sorted, not dropped
  std::size_t splits_at_gaps = 0;
  std::size_t splits_at_jumps = 0;  ///< re-used ids
  std::size_t standing_tracks = 0;  ///< kept
  std::vector<std::string> warnings;
};

struct CleanTracks {
  std::vector<Trajectory> trajectories;  ///< by source, then start time, then id; ids are unique
  std::vector<std::string>
      input_ids;  ///< of each trajectory the id of its rows, behind the name of the source if there are several
  TrackReport report;
};

/// Sorts, splits and counts: rows in, trajectories out, every row accounted for. The order of the rows has no influence
/// on the trajectories. Ids stay as they are; later tracklets of a split track are "17#2", "17#3"; if there are several
/// sources, ids begin with the shortest distinct name of the source, "file:17". Each source is one recording; if its
/// tracks have clocks of their own, each track is one. `id_prefix`: other beginnings of the ids, one for each source.
/// Units: seconds, metres. Throws: std::invalid_argument for a configuration out of range.
CleanTracks clean(std::span<const Detections> sources, const CleanConfig& config,
                  std::vector<std::string> id_prefix = {});

/// For each source (a path) the prefix of its ids: nothing for one source, else the shortest tail of the path that
/// tells all apart.
std::vector<std::string> id_prefixes(std::span<const std::string> sources);

/// "9" before "10"; numbers before names: the order of the tracks that begin at the same time.
bool id_less(const std::string& a, const std::string& b);

/// The report for people, one count a line; counts of zero are left out.
std::vector<std::string> to_lines(const TrackReport& report);

}  // namespace sila
