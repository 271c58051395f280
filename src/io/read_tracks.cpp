#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "core/concatenate.hpp"
#include "core/dropped_rows.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/track_files.hpp"
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

TrackFile read_file(const std::filesystem::path& path, const ReadOptions& options, const std::string& only_track) {
  return tracks_of_text(path.string(), read_text(path), options, only_track);
}

bool is_track_name(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  return name.ends_with(".csv") || name.ends_with(".txt") || name.ends_with(".csv.gz") || name.ends_with(".txt.gz");
}

std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && is_track_name(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Detections joined(Detections all, Detections part) {
  all.rows_read += part.rows_read;
  all.rows.insert(all.rows.end(), std::make_move_iterator(part.rows.begin()), std::make_move_iterator(part.rows.end()));
  add(all.dropped, part.dropped);
  return all;
}

TrackFile read_folder(const std::filesystem::path& folder, const ReadOptions& options) {
  if (options.format.value_or(TrackFormat::vru) != TrackFormat::vru) {
    throw FormatError(folder.string(), 0, "a file of format " + std::string(name_of(*options.format)), "a folder");
  }
  TrackFile result{{folder.string(), {}}, TrackFormat::vru, "time stamps of each track's file"};
  result.detections.own_clocks = true;
  std::vector<std::string> skipped;
  std::size_t tracks = 0;
  for (const auto& path : files_below(folder)) {
    try {
      const std::string id = path.lexically_relative(folder).generic_string();
      ReadOptions same = options;
      same.format = TrackFormat::vru;
      result.detections = joined(std::move(result.detections), read_file(path, same, id).detections);
      ++tracks;
    } catch (const FormatError& error) {
      skipped.emplace_back(error.what());
    }
  }
  if (tracks == 0) {
    const std::string found = skipped.empty() ? "no .csv or .txt file" : "none (" + skipped.front() + ")";
    throw FormatError(folder.string(), 0, "a folder of files that are one track each (header timestamp,x,y)", found);
  }
  if (!skipped.empty()) {
    result.detections.warnings.push_back(folder.string() + ": " + std::to_string(skipped.size()) + " of " +
                                         std::to_string(skipped.size() + tracks) +
                                         " files skipped, the first: " + skipped.front());
  }
  return result;
}

void require_positive(const char* field, const std::optional<double>& value) {
  if (!value || (*value > 0.0 && std::isfinite(*value))) return;
  throw std::invalid_argument(concatenate("read_detections: ", field, " = ", *value, ", it must be positive"));
}

}  // namespace

TrackFile tracks_of_text(const std::string& path, std::string_view text, const ReadOptions& options,
                         const std::string& only_track) {
  if (options.format.value_or(is_xml(text) ? TrackFormat::sumo_fcd : TrackFormat::csv) == TrackFormat::sumo_fcd)
    return require_rows(in_metres(read_sumo_fcd(path, text), options, 1.0));
  if (const auto boxes = json_boxes_format(text, options.format))
    return require_rows(read_json_boxes(path, text, *boxes, options));
  if (is_json_array(text)) return require_rows(read_json_array(path, text, options, only_track));
  const TextTable table = table_of(path, text);
  if (const auto reader = table_reader(table, options)) return require_rows(read_table(table, *reader, only_track));
  if (options.format.value_or(ndjson_format(table)) == TrackFormat::ndjson) {
    TrackFile file{read_detection_lines(table), TrackFormat::ndjson, "time stamps of \"t\""};
    return require_rows(in_metres(std::move(file), options, 1.0));
  }
  NdjsonRows rows = read_trajnetpp(table);
  const double interval_s = 1.0 / rows.samples_per_second.value_or(2.5);
  TrackFile file{std::move(rows.detections), TrackFormat::trajnetpp, {}};
  return require_rows(in_metres(with_seconds(std::move(file), options, {{}, interval_s}), options, 1.0));
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
  return read_file(path, options, path.stem().string());
}

}  // namespace sila
