#include "read_rows.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "core/dropped_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();

/// The number of `digits` digits at an offset of a text; -1 for any other text.
int digits_at(std::string_view text, std::size_t at, std::size_t digits) {
  if (at + digits > text.size()) return -1;
  int value = 0;
  for (const char c : text.substr(at, digits)) {
    if (c < '0' || c > '9') return -1;
    value = 10 * value + (c - '0');
  }
  return value;
}

/// The seconds of an offset from UTC, `+02:00` or `+02`; 0 for none or Z; null for any other text.
std::optional<double> offset_s(std::string_view text) {
  if (text.empty() || text == "Z") return 0.0;
  const int hours = digits_at(text, 1, 2);
  const int minutes = text.size() == 3 ? 0 : digits_at(text, text.find(':') == 3 ? 4 : 3, 2);
  if ((text[0] != '+' && text[0] != '-') || text.size() > 6 || hours < 0 || minutes < 0) return std::nullopt;
  return (text[0] == '-' ? -60.0 : 60.0) * (60 * hours + minutes);
}

/// Seconds since 1970 of an ISO 8601 date, `2024-05-03T12:00:00.25Z`: with a blank for the T, a fraction, an offset
/// such as +02:00 or none (UTC). Null for any other text.
std::optional<double> seconds_of_date(std::string_view text) {
  if (text.size() < 19 || text[4] != '-' || text[7] != '-' || (text[10] != 'T' && text[10] != ' ') || text[13] != ':' ||
      text[16] != ':')
    return std::nullopt;
  const int year = digits_at(text, 0, 4), month = digits_at(text, 5, 2), day = digits_at(text, 8, 2);
  const int hour = digits_at(text, 11, 2), minute = digits_at(text, 14, 2), second = digits_at(text, 17, 2);
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (year < 0 || !date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60)
    return std::nullopt;
  const std::size_t end = std::min(text.find_first_of("Z+-", 19), text.size());
  const auto fraction_s = end == 19 ? std::optional(0.0) : number_of("0" + std::string(text.substr(19, end - 19)));
  const auto offset = offset_s(text.substr(end));
  if (!fraction_s || !offset || (end > 19 && text[19] != '.')) return std::nullopt;
  const double days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return 86400.0 * days + 3600.0 * hour + 60.0 * minute + second - *offset + *fraction_s;
}

struct Fault {
  DropReason reason;
  std::string_view found;
};

/// Reads the cells of one row; keeps the first fault instead of throwing.
class RowReader {
 public:
  /// `named`: the number of cells of the header.
  RowReader(const std::vector<std::string_view>& cells, const TrackColumns& columns, std::size_t named)
      : cells_(cells), columns_(columns) {
    if (cells.size() < columns.cells) fault_ = Fault{DropReason::missing_cells, {}};
    if (cells.size() > named && !cells.back().empty()) fault_ = Fault{DropReason::extra_cells, {}};
  }

  double number(TrackColumns::Column column) {
    if (!fault_ && !in_row(column)) fault_ = Fault{DropReason::missing_cells, {}};
    if (fault_) return 0.0;
    const auto value = number_of(cells_[*column]);
    if (!value) fault_ = Fault{DropReason::not_a_number, cells_[*column]};
    return value.value_or(0.0);
  }

  /// The point, or of a box its foot or its centre. Units: those of the file.
  Vector2 position() {
    const Vector2 corner(number(columns_.x), number(columns_.y));
    Vector2 size = Vector2::Zero();
    if (columns_.width) {
      size = Vector2(number(columns_.width), number(columns_.height));
    } else if (columns_.x2) {
      size = Vector2(number(columns_.x2), number(columns_.y2)) - corner;
    } else {
      return corner;
    }
    if (!fault_ && columns_.foot && (size.x() <= 0.0 || size.y() <= 0.0)) fault_ = Fault{DropReason::bad_box, {}};
    return corner + Vector2(0.5 * size.x(), columns_.foot ? size.y() : 0.5 * size.y());
  }

  double stamp() {
    if (!columns_.time) return number(columns_.frame);
    const auto date_s = in_row(columns_.time) ? seconds_of_date(cells_[*columns_.time]) : std::nullopt;
    if (date_s && !fault_) return *date_s;
    const double nanoseconds = columns_.nanoseconds ? number(columns_.nanoseconds) : 0.0;
    return number(columns_.time) * columns_.seconds_per_time + 1e-9 * nanoseconds;
  }

  std::string track(const std::string& only_track) {
    if (fault_) return {};
    if (!columns_.id) return only_track;
    const std::string_view cell = cells_[*columns_.id];
    if (cell.empty()) fault_ = Fault{DropReason::missing_cells, "an empty track id"};
    const bool boxes = columns_.format == TrackFormat::mot || columns_.format == TrackFormat::boxes;
    if (boxes && cell.starts_with('-') && number_of(cell)) fault_ = Fault{DropReason::missing_cells, "the track id -1"};
    if (!columns_.numeric_ids) return utf8_of(cell);
    const double value = number(columns_.id);
    return std::abs(value) < 1e15 && value == std::floor(value) ? std::to_string(static_cast<long long>(value))
                                                                : std::string(cell);
  }

  std::string label() const { return in_row(columns_.label) ? utf8_of(cells_[*columns_.label]) : std::string(); }

  void reject_lost() {
    const bool lost = (columns_.format == TrackFormat::kitti && number(columns_.x) == kUnknownKittiPlace_m) ||
                      (columns_.lost && number(columns_.lost) != 0.0) ||
                      (columns_.considered && number(columns_.considered) == 0.0);
    if (lost && !fault_) fault_ = Fault{DropReason::lost, {}};
  }

  const std::optional<Fault>& fault() const { return fault_; }

 private:
  bool in_row(TrackColumns::Column column) const { return column && *column < cells_.size(); }

  const std::vector<std::string_view>& cells_;
  const TrackColumns& columns_;
  std::optional<Fault> fault_;
};

/// The rows of a table. `t_s` is in seconds if there is a column of times, else it is the frame number; positions are
/// in the units of the file. `only_track` is the id where the file is one track.
Detections read_rows(const TextTable& table, const TrackColumns& columns, const std::string& only_track) {
  Detections result{table.path, {}};
  result.rows.reserve(table.rows.size());
  const std::size_t named = columns.header ? cells_of(table.rows.front().text, columns.separator).size() : kAnyNumber;
  for (std::size_t i = columns.header ? 1 : 0; i < table.rows.size(); ++i) {
    const TextLine& line = table.rows[i];
    const auto cells = cells_of(line.text, columns.separator);
    RowReader row(cells, columns, named);
    Detection detection;
    detection.track = row.track(only_track);
    detection.t_s = row.stamp();
    detection.position_m = row.position();
    detection.label = row.label();
    detection.line = line.number;
    row.reject_lost();
    ++result.rows_read;
    if (row.fault()) {
      const auto [reason, found] = *row.fault();
      count_bad(result, reason, {found.empty() ? line.text : found, line.number});
    } else {
      result.rows.push_back(std::move(detection));
    }
  }
  return result;
}

/// The number that follows "framerate" in the comments of a Juelich file.
std::optional<double> commented_frame_rate(const TextTable& table) {
  for (const std::string& text : table.comments) {
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
bool has_centimetres(const TextTable& table) {
  return std::ranges::any_of(table.comments, [](const std::string& text) {
    return text.find("x/cm") != std::string::npos || text.find("x [cm]") != std::string::npos ||
           text.find("in cm") != std::string::npos;
  });
}

/// The path of the meta file that belongs to XX_tracks.csv, gzipped or not; nothing if it is not there.
std::optional<std::string> beside(const std::string& tracks_path, const std::string& suffix) {
  const std::size_t at = tracks_path.rfind("_tracks.csv");
  if (at == std::string::npos) return std::nullopt;
  for (const char* end : {"", ".gz"}) {
    const std::string path = tracks_path.substr(0, at) + suffix + end;
    if (std::filesystem::exists(path)) return path;
  }
  return std::nullopt;
}

/// The classes of an inD recording by track id. Throws: FormatError if the meta file is missing or wrong.
std::map<std::string, std::string> read_ind_classes(const std::string& tracks_path) {
  const auto path = beside(tracks_path, "_tracksMeta.csv");
  if (!path) {
    throw FormatError(tracks_path, 0, "a file NN_tracks.csv with NN_tracksMeta.csv beside it (it has the classes)",
                      "none");
  }
  std::map<std::string, std::string> classes;
  for (auto& [id, label] : two_columns(*path, read_text(*path), "trackid", "class"))
    classes.insert_or_assign(std::move(id), std::move(label));
  return classes;
}

/// The frame rate of an inD recording, if its meta file is there.
std::optional<double> read_ind_frame_rate(const std::string& tracks_path) {
  const auto path = beside(tracks_path, "_recordingMeta.csv");
  if (!path) return std::nullopt;
  const auto rows = two_columns(*path, read_text(*path), "recordingid", "framerate");
  const auto rate = rows.empty() ? std::nullopt : number_of(rows.front().second);
  if (!rate || !(*rate > 0.0))
    throw FormatError(*path, 2, "frameRate > 0", rows.empty() ? "no row" : excerpt(rows.front().second));
  return rate;
}

/// The rate that a format or a file states, and its scale.
ReadOptions stated_options(const TrackColumns& columns, const TextTable& table) {
  switch (columns.format) {
    case TrackFormat::obsmat:
    case TrackFormat::frame_id_x_y:
      return {.sample_interval_s = 0.4};
    case TrackFormat::stanford_drone:
      return {.frames_per_second = 30.0};
    case TrackFormat::dut:
      return {.frames_per_second = 23.98};
    case TrackFormat::kitti:
      return {.frames_per_second = 10.0};
    case TrackFormat::ind:
      if (columns.time) return {};
      return {.frames_per_second = read_ind_frame_rate(table.path)};
    case TrackFormat::juelich:
      return {.frames_per_second = commented_frame_rate(table),
              .metres_per_unit = has_centimetres(table) ? std::optional(0.01) : std::nullopt};
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
      const std::string place = exact(image_px.x()) + ", " + exact(image_px.y());
      count_bad(file.detections, DropReason::above_horizon, {place, row.line});
    }
  }
  file.detections.rows = std::move(seen);
  return file;
}

/// The number of a pedestrian where classes are numbers: 1 in MOTChallenge, 0 in COCO, which detectors use.
std::string_view person_number(TrackFormat format) {
  if (format == TrackFormat::mot) return "1";
  return format == TrackFormat::boxes || format == TrackFormat::ndjson ? "0" : "";
}

TrackFile with_persons(TrackFile file, std::vector<std::string> person_classes) {
  for (std::string& wanted : person_classes) wanted = lower(wanted);
  const std::string_view usual = person_number(file.format);
  for (Detection& row : file.detections.rows) {
    if (row.label.empty()) continue;
    const auto number = number_of(row.label);
    const std::string name = number ? exact(*number) : lower(row.label);
    if (!person_classes.empty()) {
      row.label =
          std::ranges::find(person_classes, name) != person_classes.end() ? "person" : "not asked for: " + row.label;
    } else if (!usual.empty() && name == usual) {
      row.label = "person";
    }
  }
  return file;
}

/// The commonest positive step from one frame of a person to the next; the smallest of equals, 1 if there is none.
double common_step(const std::vector<Detection>& rows) {
  std::unordered_map<std::string_view, std::vector<double>> frames;
  for (const Detection& row : rows) {
    if (std::isfinite(row.t_s)) frames[row.track].push_back(row.t_s);
  }
  std::map<double, std::size_t> counts;
  for (auto& [track, stamps] : frames) {
    std::sort(stamps.begin(), stamps.end());
    for (std::size_t i = 1; i < stamps.size(); ++i) {
      if (stamps[i] > stamps[i - 1]) ++counts[stamps[i] - stamps[i - 1]];
    }
  }
  const auto count = &std::map<double, std::size_t>::value_type::second;
  return counts.empty() ? 1.0 : std::ranges::max_element(counts, {}, count)->first;
}

/// The unit [s] of Unix times whose column names none, by their size: seconds reach 1e11 in the year 5138.
double unix_unit(const TextTable& table, const TrackColumns& columns) {
  constexpr std::array<std::string_view, 4> kWithoutUnit{"t", "time", "timestamp", "stamp"};
  if (!columns.time || std::ranges::find(kWithoutUnit, columns.time_name) == kWithoutUnit.end()) return 1.0;
  for (const TextLine& row : table.rows) {
    const auto cells = cells_of(row.text, columns.separator);
    const auto stamp = *columns.time < cells.size() ? number_of(cells[*columns.time]) : std::nullopt;
    if (!stamp || !std::isfinite(*stamp)) continue;
    return *stamp < 1e11 ? 1.0 : *stamp < 1e14 ? 1e-3 : *stamp < 1e17 ? 1e-6 : 1e-9;
  }
  return 1.0;
}

}  // namespace

void count_bad(Detections& detections, DropReason reason, const TextLine& found) {
  DroppedRows& entry = entry_of(detections.dropped, reason);
  if (entry.rows++ > 0) return;
  entry.first = detections.source + ":" + std::to_string(found.number);
  if (!found.text.empty()) entry.first += ", found " + excerpt(found.text);
  const bool decimal_comma = found.text.find_first_not_of("+-0123456789eE,") == std::string_view::npos;
  if (reason == DropReason::not_a_number && decimal_comma && std::ranges::count(found.text, ',') == 1)
    entry.first += "; numbers need a decimal point";
}

TrackFile in_metres(TrackFile file, const ReadOptions& options) {
  file = with_persons(std::move(file), options.person_classes);
  if (options.camera) return on_ground(std::move(file), *options.camera);
  const double scale = options.metres_per_unit.value_or(1.0);
  if (scale != 1.0) {
    for (Detection& row : file.detections.rows) row.position_m *= scale;
  }
  if (file.pixels && !options.metres_per_unit)
    file.detections.warnings.push_back(file.detections.source +
                                       ": these are pixels, taken as metres; give a camera or metres_per_unit");
  return file;
}

std::optional<TableReader> table_reader(const TextTable& first, const ReadOptions& options) {
  const auto columns = columns_of(first, options.format);
  if (!columns) return std::nullopt;
  TableReader reader{
      *columns, first_of(options, stated_options(*columns, first)), {}, column_warnings(first, *columns)};
  reader.columns.seconds_per_time *= unix_unit(first, *columns);
  if (!columns->label && columns->format != TrackFormat::ind && !options.person_classes.empty())
    reader.warnings.push_back(first.path + ": no column of classes, so the classes of pedestrians have no effect");
  if (columns->format == TrackFormat::ind) reader.classes = read_ind_classes(first.path);
  return reader;
}

TrackFile read_table(const TextTable& table, const TableReader& reader, const std::string& only_track) {
  const TrackColumns& columns = reader.columns;
  TrackFile file{read_rows(table, columns, only_track), columns.format, columns.pixels};
  file.detections.warnings = reader.warnings;
  if (columns.format == TrackFormat::ind) {
    for (Detection& row : file.detections.rows) {
      const auto found = reader.classes.find(row.track);
      row.label = found == reader.classes.end() ? "unknown" : found->second;
    }
  }
  if (!columns.time) file = with_seconds(std::move(file), reader.options);
  return in_metres(std::move(file), reader.options);
}

TrackFile with_seconds(TrackFile frames, const ReadOptions& options) {
  std::vector<Detection>& rows = frames.detections.rows;
  if (options.frames_per_second) {
    for (Detection& row : rows) row.t_s /= *options.frames_per_second;
  } else if (options.sample_interval_s) {
    const double step = common_step(rows);
    for (Detection& row : rows) row.t_s = row.t_s / step * *options.sample_interval_s;
  } else {
    throw FormatError(frames.detections.source, 0, "time stamps, or a frame rate (frames_per_second, --fps)",
                      "frame numbers alone");
  }
  return frames;
}

}  // namespace sila
