#pragma once

#include <map>

#include "read_rows.hpp"

namespace sila {

/// Seconds since 1970 of an ISO 8601 date, `2024-05-03T12:00:00.25Z`: with a blank for the T, a fraction, an offset
/// such as +02:00 or none (UTC). Null for any other text.
std::optional<double> seconds_of_date(std::string_view text);

/// Detections whose `t_s` still is a frame number become detections in seconds: by the frame rate of the options, else
/// by their sample interval, the time of the commonest step of a person's frames. Throws: FormatError if both are
/// unset.
TrackFile with_seconds(TrackFile frames, const ReadOptions& options);

/// How to interpret the rows of a file: by its first lines, the files beside it, and the options.
struct TableReader {
  TrackColumns columns;
  ReadOptions options;                         ///< those of the caller, else rate and scale of the format
  std::map<std::string, std::string> classes;  ///< by track id, where another file has them (inD)
  std::vector<std::string> warnings = {};      ///< of its columns
};

/// Nothing for a format of JSON lines. `first`: the whole file, or its first lines. Throws: FormatError.
std::optional<TableReader> table_reader(const TextTable& first, const ReadOptions& options);

/// The rows of a file, or of a part of it without a header line, in seconds and metres. `only_track` is the id
/// where the file is one track. Throws: FormatError if the frame rate is not known.
TrackFile read_table(const TextTable& table, const TableReader& reader, const std::string& only_track);

/// Image points through the camera of the options; else positions times their scale. Rows above the horizon of the
/// camera are dropped. Labels that the options, or the numbering of the format, call pedestrians become "person".
TrackFile in_metres(TrackFile file, const ReadOptions& options);

}  // namespace sila
