#include "table_reader.hpp"

#include <algorithm>
#include <utility>

#include "read_rows.hpp"

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
    case TrackFormat::kitti:
      return {10.0, {}};
    case TrackFormat::ind:
      return {read_ind_frame_rate(table.path), {}};
    case TrackFormat::juelich:
      return {commented_frame_rate(table), {}};
    default:
      return {};
  }
}

TrackFile on_ground(TrackFile file, const Camera& camera) {
  std::vector<Detection> seen;
  for (Detection& row : file.detections.rows) {
    const Vector2 image_px = row.position_m;
    const std::optional<Vector2> ground_m = image_px.allFinite() ? to_ground(camera, image_px) : image_px;
    if (ground_m) {
      row.position_m = *ground_m;
      seen.push_back(std::move(row));
    } else {
      count_bad(file.detections.dropped, DropReason::above_horizon, file.detections.source, row.line,
                exact(image_px.x()) + ", " + exact(image_px.y()));
    }
  }
  file.detections.rows = std::move(seen);
  return file;
}

/// The number of a pedestrian where classes are numbers: 1 in MOTChallenge, 0 in COCO, which detectors use.
std::string_view person_number(TrackFormat format) {
  if (format == TrackFormat::mot) return "1";
  return format == TrackFormat::boxes ? "0" : "";
}

TrackFile with_persons(TrackFile file, const std::vector<std::string>& person_classes) {
  const std::string_view usual = person_number(file.format);
  for (Detection& row : file.detections.rows) {
    if (row.label.empty()) continue;
    const auto number = number_of(row.label);
    const std::string name = number ? exact(*number) : lower(row.label);
    if (!person_classes.empty()) {
      row.label = std::ranges::find(person_classes, name) != person_classes.end() ? "person" : "not asked for";
    } else if (!usual.empty() && name == usual) {
      row.label = "person";
    }
  }
  return file;
}

}  // namespace

TrackFile in_metres(TrackFile file, const ReadOptions& options, double of_format) {
  file = with_persons(std::move(file), options.person_classes);
  if (options.camera) return on_ground(std::move(file), *options.camera);
  const double scale = options.metres_per_unit.value_or(of_format);
  if (scale != 1.0) {
    for (Detection& row : file.detections.rows) row.position_m *= scale;
  }
  if (file.pixels && !options.metres_per_unit) {
    file.detections.warnings.push_back(file.detections.source +
                                       ": these are pixels, taken as metres; give a camera (docs/formats.md), or "
                                       "metres_per_unit (metres per pixel) for a picture from straight above");
  }
  return file;
}

std::optional<TableReader> table_reader(const TextTable& first, const ReadOptions& options) {
  const auto columns = columns_of(first, options.format);
  if (!columns) return std::nullopt;
  TableReader reader{*columns, options, {}, 1.0, {}};
  if (columns->time == TrackColumns::kNone) reader.clock = format_clock(columns->format, first);
  if (columns->format == TrackFormat::juelich) reader.metres_per_unit = commented_metres_per_unit(first);
  if (columns->format == TrackFormat::ind) reader.classes = read_ind_classes(first.path);
  return reader;
}

TrackFile read_table(const TextTable& table, const TableReader& reader, const std::string& only_track) {
  const TrackColumns& columns = reader.columns;
  TrackFile file{read_rows(table, columns, only_track), columns.format, {}, columns.pixels};
  if (columns.format == TrackFormat::ind) {
    for (Detection& row : file.detections.rows) {
      const auto found = reader.classes.find(row.track);
      row.label = found == reader.classes.end() ? "unknown" : found->second;
    }
  }
  if (columns.time == TrackColumns::kNone) {
    file = with_seconds(std::move(file), reader.options, reader.clock);
  } else {
    file.clock = "time stamps of column " + columns.time_name;
  }
  return in_metres(std::move(file), reader.options, reader.metres_per_unit);
}

}  // namespace sila
