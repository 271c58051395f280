#pragma once

#include <span>
#include <string>

#include "promises.hpp"
#include "read_rows.hpp"
#include "sila/core/clean.hpp"

namespace sila::fuzz {

/// Reads bytes as a track file would be read, and cleans what was read.
inline void read_track_bytes(const std::string& path, const std::string& bytes, const ReadOptions& options) {
  TrackFile file;
  if (!accepts(path, lines_in(bytes),
               [&] { file = tracks_of_text(path, text_of_bytes(path, bytes), options, "only"); }))
    return;
  const Detections& read = file.detections;
  require(!read.rows.empty(), "an accepted file has a row");
  std::size_t rows = read.rows.size();
  for (const DroppedRows& dropped : read.dropped) {
    rows += dropped.rows;
    require(dropped.first.starts_with(path + ":"), "the first bad row is reported with its line", dropped.first);
  }
  require(rows == read.rows_read, "every row is kept or counted as dropped");
  for (const Detection& row : read.rows) require(row.line > 0 && row.line <= lines_in(bytes), "a row knows its line");

  const CleanTracks clean_tracks = clean(std::span(&read, 1), CleanConfig{});
  std::size_t accounted = clean_tracks.report.rows_kept;
  for (const DroppedRows& dropped : clean_tracks.report.dropped) accounted += dropped.rows;
  require(accounted == clean_tracks.report.rows_read, "cleaning accounts for every row");
  for (const Trajectory& track : clean_tracks.trajectories) validate(track);
}

}  // namespace sila::fuzz
