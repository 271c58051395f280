#include <cmath>
#include <system_error>

#include "core/concatenate.hpp"
#include "core/dropped_rows.hpp"
#include "sila/core/errors.hpp"
#include "table_reader.hpp"

namespace sila {
namespace {

std::string describe(const std::vector<DroppedRows>& dropped) {
  std::string text;
  for (const DroppedRows& entry : dropped) {
    if (!text.empty()) text += "; ";
    text += to_text(entry);
  }
  return text.empty() ? "no row" : text;
}

TrackFile require_rows(TrackFile file) {
  if (!file.detections.rows.empty()) return file;
  throw FormatError(file.detections.source, 0, "at least one usable row", describe(file.detections.dropped));
}

void require_positive(const char* field, const std::optional<double>& value) {
  if (!value || (*value > 0.0 && std::isfinite(*value))) return;
  throw invalid_argument("read_detections: ", field, " = ", *value, ", it must be positive");
}

}  // namespace

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

}  // namespace sila
