#pragma once

#include <map>

#include "sila/io/track_files.hpp"
#include "text_file.hpp"

namespace sila {

/// Which column of a table means what. Indices into the cells of a row.
struct TrackColumns {
  using Column = std::optional<std::size_t>;

  TrackFormat format = TrackFormat::csv;
  char separator = ',';         ///< ' ' for runs of blanks
  bool header = false;          ///< the first line names the columns
  Column id = {};               ///< unset: the file is one track
  Column time = {};             ///< wins over `frame`
  double seconds_per_time = 1;  ///< unit of `time`
  Column nanoseconds = {};      ///< to add to `time`, as ROS splits a stamp
  std::string time_name = {};   ///< in a header line
  Column frame = {};
  Column x = {};
  Column y = {};
  Column x2 = {};  ///< opposite corner of a box
  Column y2 = {};
  Column width = {};  ///< of a box whose left and top edges are x and y
  Column height = {};
  bool foot = false;    ///< the position of a box is the middle of its bottom edge instead of its centre
  bool pixels = false;  ///< positions are image points
  Column label = {};
  Column lost = {};          ///< not 0: the row does not count
  Column considered = {};    ///< 0: the row does not count
  std::size_t cells = 0;     ///< a row with fewer is bad
  bool numeric_ids = false;  ///< ids are written as "1.000e+00" and mean "1"
};

/// What a KITTI file has for a place that is not known [m].
inline constexpr double kUnknownKittiPlace_m = -1000.0;

/// The lines of a text that are rows, and the comments (lines that begin with '#') apart.
struct TextTable {
  std::string path;
  std::vector<TextLine> rows;
  std::vector<std::string> comments;  ///< in small letters
};

/// `first_line`: the number of the text's first line in the file. Throws: FormatError if there are no rows.
TextTable table_of(const std::string& path, std::string_view text, std::size_t first_line = 1);

/// The columns that the content shows, or nothing for a format of JSON lines.
/// Throws: FormatError if it is none of the formats, or not the one that `forced` asks for.
std::optional<TrackColumns> columns_of(const TextTable& table, std::optional<TrackFormat> forced);
/// Warnings of names in the first line that are not used, although the positions or tracks may depend on them.
std::vector<std::string> column_warnings(const TextTable& table, const TrackColumns& columns);

/// As read_detections, for the text of a file. `path` is for messages and, in the format of inD,
/// for the meta files beside it.
TrackFile tracks_of_text(const std::string& path, std::string_view text, const ReadOptions& options,
                         const std::string& only_track);

/// A recording that is a folder: files of one track each (VRU), or of one frame each (DeepStream's KITTI dump).
/// Throws: FormatError for any other folder, and for frames without a rate or of several streams.
TrackFile read_folder(const std::filesystem::path& folder, const ReadOptions& options);

/// Counts a row that cannot be used among those dropped, by reason; `found` is what was found on its line.
void count_bad(Detections& detections, DropReason reason, const TextLine& found);

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

/// A file of JSON lines: of detections, as `sila serve` receives and `sila replay` writes them, or of TrajNet++.
TrackFile read_ndjson(const TextTable& table, const ReadOptions& options);

/// Whether a text can only be XML.
bool is_xml(std::string_view text);
/// The persons of a SUMO floating-car-data export; vehicles are rows with another label. Units: seconds, metres.
/// Throws: FormatError for XML that is damaged or has another outermost element.
TrackFile read_sumo_fcd(const std::string& path, std::string_view text);

/// Whether a text can only be a JSON array.
bool is_json_array(std::string_view text);
/// The objects of a JSON array as the rows of a table whose header line has the names of the first object. Other
/// elements are counted as not_json. Throws: FormatError for an array that does not end or has no object, and as
/// table_reader.
TrackFile read_json_array(const std::string& path, std::string_view text, const ReadOptions& options,
                          const std::string& only_track);

/// The format of tracked boxes as JSON (Frigate, Axis, OTVision, OpenDataCam) that a text shows, or `forced`; null if
/// it is another one.
std::optional<TrackFormat> json_boxes_format(std::string_view text, std::optional<TrackFormat> forced);
/// A file of such a format. Units: pixels, or parts of the picture's width and height (Axis), unless the options have a
/// camera or scale. Throws: FormatError for a text of another structure or an array that does not end.
TrackFile read_json_boxes(const std::string& path, std::string_view text, TrackFormat format,
                          const ReadOptions& options);

/// Two columns of a CSV with header, by name in lower case. Throws: FormatError for a column or a cell that is missing.
std::vector<std::pair<std::string, std::string>> two_columns(const std::string& path, const std::string& text,
                                                             const char* first, const char* second);

}  // namespace sila
