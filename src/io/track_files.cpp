#include "sila/io/track_files.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "core/concatenate.hpp"
#include "core/dropped_rows.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"

namespace sila {
namespace {

constexpr std::array<TrackFormatText, 19> kFormats{{
    {TrackFormat::csv, "csv", "a header line with track_id,t,x,y"},
    {TrackFormat::obsmat, "obsmat", "8 columns: frame id x z y vx vz vy"},
    {TrackFormat::frame_id_x_y, "frame-id-x-y", "4 columns: frame id x y"},
    {TrackFormat::trajnetpp, "trajnetpp", "lines like {\"track\": {\"f\": 0, \"p\": 1, \"x\": 0.5, \"y\": 2.0}}"},
    {TrackFormat::stanford_drone, "sdd", "10 columns: id xmin ymin xmax ymax frame lost occluded generated \"label\""},
    {TrackFormat::ind, "ind", "a header line with trackId,frame,xCenter,yCenter"},
    {TrackFormat::sind, "sind", "a header line with track_id,timestamp_ms,agent_type,x,y"},
    {TrackFormat::dut, "dut", "a header line with id,frame,label,x_est,y_est"},
    {TrackFormat::vru, "vru", "a header line with timestamp,x,y"},
    {TrackFormat::juelich, "juelich", "columns: id frame x y z"},
    {TrackFormat::ndjson, "ndjson", "lines like {\"t\": 0.1, \"id\": \"a\", \"x\": 0.5, \"y\": 2.0}"},
    {TrackFormat::mot, "mot", "7, 9 or 10 columns with commas: frame,id,left,top,width,height,confidence"},
    {TrackFormat::kitti, "kitti", "17 or 18 columns: frame id type truncated occluded alpha left top right bottom ..."},
    {TrackFormat::sumo_fcd, "sumo-fcd", "XML like <fcd-export><timestep time=\"0\"><person id=\"a\" x=\"1\" y=\"2\"/>"},
    {TrackFormat::boxes, "boxes", "a header line with x_min,y_min,x_max,y_max,tracker_id and a frame or time"},
    {TrackFormat::frigate, "frigate",
     "lines like {\"after\": {\"id\": \"a\", \"frame_time\": 1.5, \"box\": [1, 2, 3, 4]}}"},
    {TrackFormat::axis, "axis", "lines like {\"frame\": {\"timestamp\": ..., \"observations\": [...]}}"},
    {TrackFormat::ottrk, "ottrk", "JSON like {\"metadata\": ..., \"data\": {\"detections\": [...]}}"},
    {TrackFormat::opendatacam, "opendatacam", "a JSON array of {\"timestamp\": ..., \"objects\": [...]}"},
}};

TrackFile require_rows(TrackFile file) {
  if (!file.detections.rows.empty()) return file;
  const std::string dropped =
      joined(file.detections.dropped, "; ", [](const DroppedRows& entry) { return to_text(entry); });
  throw FormatError(file.detections.source, 0, "at least one usable row", dropped.empty() ? "no row" : dropped);
}

void require_positive(const char* field, const std::optional<double>& value) {
  if (!value || (*value > 0.0 && std::isfinite(*value))) return;
  throw invalid_argument("read_detections: ", field, " = ", *value, ", it must be positive");
}

/// Without quotes a comma separates, blanks at the ends are cut, `#` begins a comment and `'` may be a quote. Throws:
/// std::invalid_argument for an id that the reader cannot read back, as no character is escaped.
std::string quoted_if_needed(const std::string& id) {
  if (id.empty() || id.find_first_of(std::string_view("\"\n\0", 3)) != std::string::npos)
    throw std::invalid_argument("write_tracks_csv: id = " + excerpt(id) +
                                " is empty or has a quote, a line end or a zero byte, which CSV cannot hold");
  const bool plain = id.find_first_of(", \t\r\v\f") == std::string::npos && id.front() != '#' && id.front() != '\'';
  return plain ? id : '"' + id + '"';
}

}  // namespace

std::span<const TrackFormatText> track_formats() {
  return kFormats;
}

std::string_view name_of(TrackFormat format) {
  return kFormats[static_cast<std::size_t>(format)].name;
}

std::optional<TrackFormat> track_format(std::string_view name) {
  const auto found = std::ranges::find(kFormats, name, &TrackFormatText::name);
  return found == kFormats.end() ? std::nullopt : std::optional(found->format);
}

TrackFormat required_format(std::string_view name, const std::string& what) {
  if (const auto format = track_format(name)) return *format;
  throw invalid_argument(what, " is not one of ", joined(kFormats, ", ", &TrackFormatText::name));
}

TrackFile tracks_of_text(const std::string& path, std::string_view text, const ReadOptions& options,
                         const std::string& only_track) {
  if (options.format.value_or(is_xml(text) ? TrackFormat::sumo_fcd : TrackFormat::csv) == TrackFormat::sumo_fcd)
    return require_rows(in_metres(read_sumo_fcd(path, text), options));
  if (const auto boxes = json_boxes_format(text, options.format))
    return require_rows(read_json_boxes(path, text, *boxes, options));
  if (is_json_array(text)) return require_rows(read_json_array(path, text, options, only_track));
  const TextTable table = table_of(path, text);
  if (const auto reader = table_reader(table, options)) return require_rows(read_table(table, *reader, only_track));
  return require_rows(read_ndjson(table, options));
}

ReadOptions first_of(const ReadOptions& first, const ReadOptions& second) {
  ReadOptions result = first;
  if (!result.format) result.format = second.format;
  // A rate given by the user must not lose against an interval of the other, nor the other way round.
  if (!result.frames_per_second && !result.sample_interval_s) {
    result.frames_per_second = second.frames_per_second;
    result.sample_interval_s = second.sample_interval_s;
  }
  // Likewise a scale and a camera.
  if (!result.metres_per_unit && !result.camera) {
    result.metres_per_unit = second.metres_per_unit;
    result.camera = second.camera;
  }
  if (result.person_classes.empty()) result.person_classes = second.person_classes;
  if (!result.frigate_camera) result.frigate_camera = second.frigate_camera;
  return result;
}

void validate(const ReadOptions& options) {
  require_positive("frames_per_second", options.frames_per_second);
  require_positive("sample_interval_s", options.sample_interval_s);
  require_positive("metres_per_unit", options.metres_per_unit);
  if (options.camera && options.metres_per_unit)
    throw std::invalid_argument("read_detections: camera and metres_per_unit are both given; one of them makes metres");
}

TrackFile read_detections(const std::filesystem::path& path, const ReadOptions& options) {
  validate(options);
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return read_folder(path, options);
  return tracks_of_text(path.string(), read_text(path), options, path.stem().string());
}

void write_tracks_csv(const std::filesystem::path& path, std::span<const Trajectory> tracks) {
  std::string text = "track_id,t,x,y\n";
  for (const Trajectory& track : tracks) {
    validate(track);
    const std::string id = quoted_if_needed(track.id);
    for (std::size_t i = 0; i < track.times_s.size(); ++i) {
      const Vector2& position = track.positions_m[i];
      text += id + ',' + exact(track.times_s[i]) + ',' + exact(position.x()) + ',' + exact(position.y()) + '\n';
    }
  }
  write_file(path, text);
}

}  // namespace sila
