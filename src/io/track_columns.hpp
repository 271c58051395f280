#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sila/io/track_files.hpp"
#include "text_file.hpp"

namespace sila {

/// Which column of a table means what. Indices into the cells of a row.
struct TrackColumns {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  TrackFormat format = TrackFormat::csv;
  char separator = ',';         ///< ' ' for runs of blanks
  bool header = false;          ///< the first line names the columns
  std::size_t id = kNone;       ///< kNone: the file is one track
  std::size_t time = kNone;     ///< wins over `frame`
  double seconds_per_time = 1;  ///< unit of `time`
  std::string time_name = {};
  std::size_t frame = kNone;
  std::size_t x = kNone;
  std::size_t y = kNone;
  std::size_t x2 = kNone;  ///< opposite corner of a box
  std::size_t y2 = kNone;
  std::size_t width = kNone;  ///< of a box whose left and top edges are x and y
  std::size_t height = kNone;
  bool foot = false;    ///< the position of a box is the middle of its bottom edge instead of its centre
  bool pixels = false;  ///< positions are image points
  std::size_t label = kNone;
  std::size_t lost = kNone;        ///< not 0: the row does not count
  std::size_t considered = kNone;  ///< 0: the row does not count
  std::size_t cells = 0;           ///< a row with fewer is bad
  bool numeric_ids = false;        ///< ids are written as "1.000e+00" and mean "1"
};

/// The lines of a text that are rows, and the comments (lines that begin with '#') apart.
struct TextTable {
  std::string path;
  std::vector<TextLine> rows;
  std::vector<std::string_view> comments;
};

/// `first_line`: the number of the text's first line in the file. Throws: FormatError if there are no rows.
TextTable table_of(const std::string& path, std::string_view text, std::size_t first_line = 1);

/// Which of the two formats of one JSON object a line.
TrackFormat ndjson_format(const TextTable& table);

/// The columns that the content shows, or nothing for a format of JSON lines.
/// Throws: FormatError if it is none of the formats, or not the one that `forced` asks for.
std::optional<TrackColumns> columns_of(const TextTable& table, std::optional<TrackFormat> forced);

/// The columns of a header line, or nothing if it does not name enough.
std::optional<TrackColumns> header_columns(std::string_view header);

}  // namespace sila
