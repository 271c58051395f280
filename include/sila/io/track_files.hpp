#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sila/core/camera.hpp"
#include "sila/core/detections.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// The formats of docs/formats.md.
enum class TrackFormat {
  csv,             ///< header with a track id, a time (or frame) and x, y
  obsmat,          ///< ETH/UCY, 8 columns: frame id x z y vx vz vy
  frame_id_x_y,    ///< the 4-column form
  trajnetpp,       ///< TrajNet++ ndjson
  stanford_drone,  ///< 10 columns: id xmin ymin xmax ymax frame lost occluded generated "label"
  ind,             ///< inD, rounD, uniD: XX_tracks.csv with its two meta files beside it
  sind,            ///< SinD Ped_smoothed_tracks.csv
  dut,             ///< DUT: id,frame,label,x_est,y_est,...
  vru,             ///< one track a file: timestamp,x,y; a folder of them is one source
  juelich,         ///< # comments, then: id frame x y z
  ndjson,          ///< what `sila serve` receives: {"t", "id", "x", "y"}
  mot,             ///< MOTChallenge: frame,id,left,top,width,height,confidence,...
  kitti,           ///< KITTI tracking, 17 or 18 columns
  sumo_fcd,        ///< SUMO floating car data, XML
  boxes,           ///< CSV with a header that names the edges of a box: Supervision, Ultralytics
  frigate,         ///< events of Frigate, JSON lines as on its topic frigate/events
  axis,            ///< Axis analytics scene description, JSON lines of frames
  ottrk,           ///< tracks of OTVision, JSON
  opendatacam,     ///< tracker history of OpenDataCam, JSON
};

struct TrackFormatText {
  TrackFormat format;
  std::string_view name;     ///< as on the command line and in scene files
  std::string_view columns;  ///< for messages
};

/// Every format once.
std::span<const TrackFormatText> track_formats();
/// The name of a format on the command line and in scene files.
std::string_view name_of(TrackFormat format);
/// The format of that name; null if there is none.
std::optional<TrackFormat> track_format(std::string_view name);
/// The same. Throws: std::invalid_argument "<what> is not one of csv, obsmat, ...".
TrackFormat required_format(std::string_view name, const std::string& what);

/// Information that is not in a file. Unset fields follow the rules of the format (docs/formats.md).
struct ReadOptions {
  std::optional<TrackFormat> format = {};  ///< unset: recognised by content
  /// Makes seconds of frame numbers; no effect on files with time stamps.
  std::optional<double> frames_per_second = {};
  std::optional<double> sample_interval_s = {};  ///< time between annotations; used if `frames_per_second` is unset
  std::optional<double> metres_per_unit = {};    ///< size of a pixel, centimetre, ... [m]; unset: the file is in metres
  std::optional<Camera> camera = {};             ///< makes metres of pixels, instead of `metres_per_unit`
  std::vector<std::string> person_classes = {};  ///< names or numbers that are pedestrians; empty: those of the format
  std::optional<std::string> frigate_camera = {};  ///< whose events count; unset: all
  bool operator==(const ReadOptions&) const = default;
};

/// `first` where it is set, else `second`, field by field.
ReadOptions first_of(const ReadOptions& first, const ReadOptions& second);

/// Throws std::invalid_argument for a rate, interval or scale that is not positive and finite, and for a camera beside
/// a scale.
void validate(const ReadOptions& options);

/// Names of the column of classes in a table; the first that is there is used.
inline constexpr std::array<std::string_view, 13> kClassColumns = {
    "label",    "class",    "class_name", "agent_type",  "agent_class", "object_type", "object_class",
    "category", "class_id", "cls",        "class_label", "obj_class",   "type"};

struct TrackFile {
  Detections detections;
  TrackFormat format = TrackFormat::csv;
  bool pixels = false;  ///< the file has image points: they need a camera or a scale
};

/// Reads a track file, gzipped or not, or a folder of one-track files.
/// Bad rows are counted by reason in `detections`; `clean` checks labels and units.
/// Units: seconds on the clock of the file, metres.
/// Throws: FormatError for a file that is missing, empty, truncated, binary, of no known format or without a usable
/// row; std::invalid_argument for options out of range.
TrackFile read_detections(const std::filesystem::path& path, const ReadOptions& options = {});

/// The detections of one line of a live tracker, by the readers of files: `{"t": 12.3, "id": "a", "x": 1.5, "y": 2.0}`
/// with an id of 1 to 64 bytes or a whole number, and a `label` if there is one; an event of Frigate; a frame of Axis.
/// Null for any other JSON. Units: seconds, and those of the line. Throws: nothing of its own.
std::optional<TrackFile> live_detections(const nlohmann::json& json, const ReadOptions& options);

/// Writes the generic CSV, header `track_id,t,x,y`; every number reads back as the same double. The file appears whole
/// or not at all. Units: seconds, metres. Throws: FormatError if the path cannot be written; std::invalid_argument for
/// an id that is empty or has a double quote, a line end or a zero byte.
void write_tracks_csv(const std::filesystem::path& path, std::span<const Trajectory> tracks);

}  // namespace sila
