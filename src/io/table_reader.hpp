#pragma once

#include <map>
#include <optional>
#include <string>

#include "clock.hpp"
#include "track_columns.hpp"

namespace sila {

/// How to interpret the rows of a file: by its first lines, the files beside it, and the options.
struct TableReader {
  TrackColumns columns;
  ReadOptions options;
  FrameClock clock;                            ///< of the format, if there are frame numbers alone
  double metres_per_unit = 1.0;                ///< of the format; the options win
  std::map<std::string, std::string> classes;  ///< by track id, where another file has them (inD)
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
