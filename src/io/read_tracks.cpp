#include "sila/io/read_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "clock.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

/// The number that follows "framerate" in the comments of a Juelich file.
std::optional<double> commented_frame_rate(const TextTable& table) {
  for (const std::string_view comment : table.comments) {
    const std::string text = lower(comment);
    const std::size_t at = std::min(text.find("framerate"), text.find("frame rate"));
    if (at == std::string::npos) continue;
    const std::size_t begin = text.find_first_of("0123456789.", at);
    if (begin == std::string::npos) continue;
    const std::size_t end = std::min(text.find_first_not_of("0123456789.", begin), text.size());
    const auto rate = number_of(std::string_view(text).substr(begin, end - begin));
    if (rate && *rate > 0.0) return rate;
  }
  return std::nullopt;
}

/// Juelich files may say that their columns are "x/cm".
double commented_metres_per_unit(const TextTable& table) {
  const bool centimetres = std::any_of(table.comments.begin(), table.comments.end(), [](std::string_view comment) {
    const std::string text = lower(comment);
    return text.find("x/cm") != std::string::npos || text.find("x [cm]") != std::string::npos ||
           text.find("in cm") != std::string::npos;
  });
  return centimetres ? 0.01 : 1.0;
}

FrameClock format_clock(TrackFormat format, const TextTable& table) {
  switch (format) {
    case TrackFormat::obsmat:
    case TrackFormat::frame_id_x_y:
      return {{}, 0.4};
    case TrackFormat::stanford_drone:
      return {30.0, {}};
    case TrackFormat::dut:
      return {23.98, {}};
    case TrackFormat::ind:
      return {read_ind_frame_rate(table.path), {}};
    case TrackFormat::juelich:
      return {commented_frame_rate(table), {}};
    default:
      return {};
  }
}

TrackFile read_table(const TextTable& table, const Layout& layout, const ReadOptions& options,
                     const std::string& only_track) {
  TrackFile file{read_rows(table, layout, only_track), layout.format, {}};
  if (layout.format == TrackFormat::ind) {
    const auto classes = read_ind_classes(table.path);
    for (Detection& row : file.detections.rows) {
      const auto found = classes.find(row.track);
      row.label = found == classes.end() ? "unknown" : found->second;
    }
  }
  if (layout.time == Layout::kNone) return with_seconds(std::move(file), options, format_clock(layout.format, table));
  file.clock = "time stamps of column " + layout.time_name;
  return file;
}

TrackFile in_metres(TrackFile file, const ReadOptions& options, double of_format) {
  const double scale = options.metres_per_unit.value_or(of_format);
  if (scale != 1.0) {
    for (Detection& row : file.detections.rows) row.position_m *= scale;
  }
  if (file.format == TrackFormat::stanford_drone && !options.metres_per_unit) {
    file.detections.warnings.push_back(file.detections.source +
                                       ": these are pixels, taken as metres; give metres_per_unit (metres per pixel)");
  }
  return file;
}

std::string describe(const std::vector<DroppedRows>& dropped) {
  std::string text;
  for (const DroppedRows& entry : dropped) {
    if (!text.empty()) text += "; ";
    text += std::to_string(entry.rows) + " " + std::string(kDropReasons[static_cast<std::size_t>(entry.reason)].text) +
            " (first " + entry.first + ")";
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
  for (DroppedRows& entry : part.dropped) {
    const auto same = [&](const DroppedRows& other) { return other.reason == entry.reason; };
    const auto found = std::find_if(all.dropped.begin(), all.dropped.end(), same);
    if (found == all.dropped.end()) {
      all.dropped.push_back(std::move(entry));
    } else {
      found->rows += entry.rows;
    }
  }
  return all;
}

TrackFile read_folder(const std::filesystem::path& folder, const ReadOptions& options) {
  if (options.format.value_or(TrackFormat::vru) != TrackFormat::vru) {
    throw FormatError(folder.string(), 0, "a file of format " + std::string(name_of(*options.format)), "a folder");
  }
  TrackFile result{{folder.string(), {}}, TrackFormat::vru, "time stamps of each track's file"};
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
  std::ostringstream text;
  text << "read_detections: " << field << " = " << *value << ", it must be positive";
  throw std::invalid_argument(text.str());
}

}  // namespace

TrackFile tracks_of_text(const std::string& path, std::string_view text, const ReadOptions& options,
                         const std::string& only_track) {
  const TextTable table = table_of(path, text);
  const auto layout = layout_of(table, options.format);
  if (layout) {
    const double scale = layout->format == TrackFormat::juelich ? commented_metres_per_unit(table) : 1.0;
    return require_rows(in_metres(read_table(table, *layout, options, only_track), options, scale));
  }
  NdjsonRows rows = read_ndjson(table);
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
  if (!result.metres_per_unit) result.metres_per_unit = second.metres_per_unit;
  return result;
}

void validate(const ReadOptions& options) {
  require_positive("frames_per_second", options.frames_per_second);
  require_positive("sample_interval_s", options.sample_interval_s);
  require_positive("metres_per_unit", options.metres_per_unit);
}

TrackFile read_detections(const std::filesystem::path& path, const ReadOptions& options) {
  validate(options);
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) return read_folder(path, options);
  return read_file(path, options, path.stem().string());
}

}  // namespace sila
