#pragma once

#include <map>

#include "read_rows.hpp"

namespace sila {

/// The clock that a format or a file states; unset members are not known.
struct FrameClock {
  std::optional<double> frames_per_second;
  std::optional<double> sample_interval_s;  ///< between the annotations of one person
};

/// Seconds since 1970 of an ISO 8601 date, `2024-05-03T12:00:00.25Z`: with a blank for the T, a fraction, an offset
/// such as +02:00 or none (UTC). Null for any other text.
std::optional<double> seconds_of_date(std::string_view text);

/// Detections whose `t_s` still is a frame number become detections in seconds: by the frame rate of the options, else
/// by their sample interval, else by what the format says. An interval is the time of the commonest step of a person's
/// frames. Throws: FormatError if the rate is not known.
TrackFile with_seconds(TrackFile frames, const ReadOptions& options, const FrameClock& of_format);

/// How to interpret the rows of a file: by its first lines, the files beside it, and the options.
struct TableReader {
  TrackColumns columns;
  ReadOptions options;
  FrameClock clock;                            ///< of the format, if there are frame numbers alone
  double metres_per_unit = 1.0;                ///< of the format; the options win
  std::map<std::string, std::string> classes;  ///< by track id, where another file has them (inD)
  std::vector<std::string> warnings = {};      ///< of its columns
};

/// Nothing for a format of JSON lines. `first`: the whole file, or its first lines. Throws: FormatError.
std::optional<TableReader> table_reader(const TextTable& first, const ReadOptions& options);

/// The rows of a file, or of a part of it without a header line, in seconds and metres. `only_track` is the id
/// where the file is one track. Throws: FormatError if the frame rate is not known.
TrackFile read_table(const TextTable& table, const TableReader& reader, const std::string& only_track);

/// Image points through the camera of the options; else positions times the scale of the options, else of the format.
/// Rows above the horizon of the camera are dropped. Labels that the options, or the numbering of the format, call
/// pedestrians become "person".
TrackFile in_metres(TrackFile file, const ReadOptions& options, double of_format);

}  // namespace sila
