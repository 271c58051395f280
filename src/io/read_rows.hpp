#pragma once

#include <map>
#include <optional>
#include <string>

#include "sila/core/detections.hpp"
#include "track_columns.hpp"

namespace sila {

/// As read_detections, for the text of a file. `path` is for messages and, in the format of inD,
/// for the meta files beside it.
TrackFile tracks_of_text(const std::string& path, std::string_view text, const ReadOptions& options,
                         const std::string& only_track);

/// Counts a row that cannot be used in a list by reason.
void count_bad(std::vector<DroppedRows>& dropped, DropReason reason, const std::string& path, std::size_t line,
               std::string_view found);

/// The rows of a table. `t_s` is in seconds if there is a column of times, else it is the frame number; positions are
/// in the units of the file. `only_track` is the id where the file is one track.
Detections read_rows(const TextTable& table, const TrackColumns& columns, const std::string& only_track);

/// The rows of TrajNet++ ndjson, `t_s` the frame number, and the rate that its scenes name.
struct NdjsonRows {
  Detections detections;
  std::optional<double> samples_per_second;
};
NdjsonRows read_trajnetpp(const TextTable& table);

/// A detection as JSON, `{"t": 12.3, "id": "a", "x": 1.5, "y": 2.0}`; null for any other JSON.
std::optional<Detection> detection_of(const nlohmann::json& json);
/// The lines that `sila serve` receives and `sila replay` writes, a detection each, `t_s` in seconds.
Detections read_detection_lines(const TextTable& table);

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

/// The classes of an inD recording by track id. Throws: FormatError if the meta file is missing or wrong.
std::map<std::string, std::string> read_ind_classes(const std::string& tracks_path);
/// The frame rate of an inD recording, if its meta file is there.
std::optional<double> read_ind_frame_rate(const std::string& tracks_path);

}  // namespace sila
