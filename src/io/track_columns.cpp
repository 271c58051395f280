#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <span>
#include <utility>

#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

using Names = std::initializer_list<std::string_view>;

TrackColumns::Column column(const std::vector<std::string>& names, std::span<const std::string_view> aliases) {
  for (const std::string_view alias : aliases) {
    const auto found = std::find(names.begin(), names.end(), alias);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  }
  return std::nullopt;
}

TrackColumns::Column column(const std::vector<std::string>& names, Names aliases) {
  return column(names, std::span(aliases.begin(), aliases.size()));
}

bool has_all(const std::vector<std::string>& names, Names wanted) {
  return std::ranges::all_of(wanted, [&](std::string_view name) { return std::ranges::count(names, name) > 0; });
}

std::vector<std::string> names_of(std::string_view header, char separator) {
  std::vector<std::string> names;
  for (const std::string_view cell : cells_of(header, separator)) names.push_back(lower(cell));
  return names;
}

char separator_of(std::string_view header) {
  const auto count = [&](char separator) { return std::ranges::count(header, separator); };
  const char best = *std::ranges::max_element(std::string_view(",;\t"), {}, count);
  return count(best) > 0 ? best : ' ';
}

void find_time(TrackColumns& columns, const std::vector<std::string>& names) {
  const auto use = [&](Names aliases, double seconds) {
    if (columns.time) return;
    columns.time = column(names, aliases);
    if (columns.time) columns.seconds_per_time = seconds;
  };
  use({"t", "t_s", "time", "time_s", "timestamp", "timestamp_s", "seconds", "sec", "secs", "time_sec", "stamp"}, 1.0);
  use({"t_ms", "time_ms", "timestamp_ms", "milliseconds"}, 1e-3);
  use({"t_us", "time_us", "timestamp_us", "microseconds"}, 1e-6);
  use({"t_ns", "time_ns", "timestamp_ns", "stamp_ns", "nanoseconds"}, 1e-9);
  columns.nanoseconds = column(names, {"nsec", "nsecs", "nanosec", "nanosecs"});
  if (columns.time) columns.time_name = names[*columns.time];
}

/// The edges of a box, or its left and top edge with its size.
void find_box(TrackColumns& columns, const std::vector<std::string>& names) {
  columns.x = column(names, {"x_min", "xmin", "x1", "left", "bb_left", "bbox_left"});
  columns.y = column(names, {"y_min", "ymin", "y1", "top", "bb_top", "bbox_top"});
  columns.x2 = column(names, {"x_max", "xmax", "x2", "right"});
  columns.y2 = column(names, {"y_max", "ymax", "y2", "bottom"});
  if (!columns.x2 || !columns.y2) {
    columns.x2.reset();
    columns.width = column(names, {"width", "w", "bb_width", "bbox_width"});
    columns.height = column(names, {"height", "h", "bb_height", "bbox_height"});
    if (!columns.width || !columns.height) columns.x.reset();
  }
  columns.foot = columns.pixels = true;
}

/// Names of MOTChallenge; its x, y and z are not used.
bool has_mot_names(const std::vector<std::string>& names) {
  return has_all(names, {"frame", "bb_left", "bb_top", "bb_width", "bb_height"}) &&
         (!has_all(names, {"x"}) || has_all(names, {"z"}));
}

TrackFormat format_of_names(const TrackColumns& columns, const std::vector<std::string>& names) {
  if (!columns.id) return TrackFormat::vru;
  if (has_all(names, {"trackid", "xcenter", "ycenter", "frame"})) return TrackFormat::ind;
  if (has_all(names, {"track_id", "timestamp_ms", "agent_type"})) return TrackFormat::sind;
  if (has_all(names, {"x_est", "y_est", "frame"})) return TrackFormat::dut;
  if (columns.pixels) return has_mot_names(names) ? TrackFormat::mot : TrackFormat::boxes;
  return TrackFormat::csv;
}

std::size_t widest(const TrackColumns& columns) {
  const auto last = std::max({columns.id, columns.time, columns.nanoseconds, columns.frame, columns.x, columns.y,
                              columns.x2, columns.y2, columns.width, columns.height, columns.lost});
  return last.value_or(0) + 1;  // no column is less than any
}

/// The content of a file is recognised by its first rows.
constexpr std::size_t kInspectedRows = 25;

/// The columns of a header line, or nothing if it does not name enough.
std::optional<TrackColumns> header_columns(std::string_view header) {
  TrackColumns columns;
  columns.header = true;
  columns.separator = separator_of(header);
  const std::vector<std::string> names = names_of(header, columns.separator);
  columns.id = column(names, {"track_id", "trackid", "track", "ped_id", "pedestrian_id", "person_id", "agent_id",
                              "object_id", "obj_id", "traj_id", "trajectory_id", "tracker_id", "tracking_id",
                              "track id", "personid", "pedestrianid", "objectid", "tid", "id"});
  find_time(columns, names);
  columns.frame =
      column(names, {"frame", "frame_id", "frameid", "frame_number", "frame_no", "frame_index", "frame_idx"});
  columns.x =
      column(names, {"x", "x_m", "pos_x", "position_x", "xcenter", "x_est", "x_center", "world_x", "x_world", "px"});
  columns.y =
      column(names, {"y", "y_m", "pos_y", "position_y", "ycenter", "y_est", "y_center", "world_y", "y_world", "py"});
  columns.label = column(names, kClassColumns);
  if (has_mot_names(names) || (!columns.x && !columns.y)) find_box(columns, names);
  const bool timed = columns.time || (columns.frame && columns.id);
  if (!timed || !columns.x || !columns.y) return std::nullopt;
  columns.format = format_of_names(columns, names);
  if (columns.format == TrackFormat::mot && has_all(names, {"visibility"}))
    columns.considered = column(names, {"conf"});  // of a ground truth a flag
  columns.cells = widest(columns);
  return columns;
}

/// The columns of a format without a header line, by the names that they would have; a row has at least `cells`.
TrackColumns named_columns(TrackFormat format, std::string_view names, std::size_t cells) {
  TrackColumns columns = header_columns(names).value();
  columns.format = format;
  columns.header = false;
  columns.cells = cells;
  columns.numeric_ids = true;
  return columns;
}

/// The columns of a format that has no header line and only one meaning; null for others.
std::optional<TrackColumns> fixed_columns(TrackFormat format) {
  if (format == TrackFormat::obsmat) return named_columns(format, "frame id x z y vx vz vy", 8);
  if (format == TrackFormat::frame_id_x_y) return named_columns(format, "frame id x y", 4);
  if (format == TrackFormat::juelich) return named_columns(format, "id frame x y", 4);
  if (format != TrackFormat::stanford_drone) return std::nullopt;
  TrackColumns columns = named_columns(format, "id xmin ymin xmax ymax frame lost occluded generated label", 10);
  columns.lost = 6;
  columns.foot = columns.numeric_ids = false;
  return columns;
}

/// 9 cells are those of a ground truth: a flag, a class and the visibility instead of a confidence and a position.
TrackColumns mot_columns(std::size_t cells) {
  const std::string box = "frame,id,bb_left,bb_top,bb_width,bb_height";
  return named_columns(TrackFormat::mot, cells == 9 ? box + ",conf,class,visibility" : box, 6);
}

/// The 3D place in the camera frame (x to the right, z ahead) where there is one, else the box.
TrackColumns kitti_columns(const TextTable& table) {
  bool placed = false;
  for (std::size_t i = 0; i < std::min(kInspectedRows, table.rows.size()); ++i) {
    const auto cells = cells_of(table.rows[i].text, ' ');
    if (cells.size() < 17) continue;
    const auto x = number_of(cells[13]), z = number_of(cells[15]);
    placed = placed || (x && z && *x != kUnknownKittiPlace_m && *z != kUnknownKittiPlace_m && (*x != 0.0 || *z != 0.0));
  }
  const std::string box = "frame id type truncated occluded alpha left top right bottom";
  return named_columns(TrackFormat::kitti, placed ? box + " height width length x down y" : box, 17);
}

/// How many of the leading cells are numbers.
std::size_t leading_numbers(const std::vector<std::string_view>& cells) {
  const auto end = std::find_if(cells.begin(), cells.end(), [](std::string_view cell) { return !number_of(cell); });
  return static_cast<std::size_t>(end - cells.begin());
}

struct Shape {
  std::size_t cells = 0;
  std::size_t numbers = 0;
  auto operator<=>(const Shape&) const = default;
};

/// The commonest shape of the first rows, so that one damaged row does not decide; of those with commas or without.
Shape common_shape(const TextTable& table, bool with_commas) {
  std::map<Shape, std::size_t> counts;
  for (std::size_t i = 0; i < std::min(kInspectedRows, table.rows.size()); ++i) {
    if ((table.rows[i].text.find(',') != std::string_view::npos) != with_commas) continue;
    const auto cells = cells_of(table.rows[i].text, with_commas ? ',' : ' ');
    ++counts[{cells.size(), leading_numbers(cells)}];
  }
  const auto count = &std::map<Shape, std::size_t>::value_type::second;
  return counts.empty() ? Shape{} : std::ranges::max_element(counts, {}, count)->first;
}

bool comments_name_juelich(const TextTable& table) {
  return std::ranges::any_of(table.comments, [](const std::string& text) {
    return text.find("framerate") != std::string::npos || text.find("frame rate") != std::string::npos ||
           (text.find("id") != std::string::npos && text.find("frame") > text.find("id") &&
            text.find("frame") != std::string::npos);
  });
}

/// frame id x y; the first column has seconds if not all its numbers are whole.
TrackColumns frame_or_time_columns(const TextTable& table) {
  TrackColumns columns = *fixed_columns(TrackFormat::frame_id_x_y);
  const auto has_part = [](const TextLine& row) {
    const auto cells = cells_of(row.text, ' ');  // none in a row of separators
    return !cells.empty() && std::abs(std::fmod(number_of(cells[0]).value_or(0.0), 1.0)) > 0.0;
  };
  // Of stamps 0.5 s apart every other one; a few damaged frame numbers do not decide.
  if (4 * std::ranges::count_if(table.rows, has_part) > std::ssize(table.rows))
    columns.time = std::exchange(columns.frame, std::nullopt);
  return columns;
}

std::optional<TrackColumns> headerless_columns(const TextTable& table) {
  const Shape commas = common_shape(table, true);  // of other numbers of columns the meaning is not known
  if (commas.numbers == commas.cells && (commas.cells == 7 || commas.cells == 9 || commas.cells == 10))
    return mot_columns(commas.cells);
  const Shape shape = common_shape(table, false);
  if ((shape.cells == 17 || shape.cells == 18) && shape.numbers == 2) return kitti_columns(table);
  if (shape.cells == 10 && shape.numbers == 9) return fixed_columns(TrackFormat::stanford_drone);
  if (shape.numbers != shape.cells) return std::nullopt;
  if (shape.cells == 8) return fixed_columns(TrackFormat::obsmat);
  if (shape.cells == 5 || (shape.cells == 4 && comments_name_juelich(table)))
    return fixed_columns(TrackFormat::juelich);
  if (shape.cells == 4) return frame_or_time_columns(table);
  return std::nullopt;
}

bool looks_like_ndjson(const TextTable& table) {
  const std::string_view first = trimmed(table.rows.front().text);
  const auto has = [&](std::string_view key) { return first.find(key) != std::string_view::npos; };
  return first.starts_with('{') && first.ends_with('}') &&
         (has("\"track\"") || has("\"scene\"") || (has("\"t\"") && has("\"id\"")));
}

std::optional<TrackColumns> forced_columns(const TextTable& table, TrackFormat format) {
  if (format == TrackFormat::trajnetpp || format == TrackFormat::ndjson) return std::nullopt;
  if (format == TrackFormat::frame_id_x_y) return frame_or_time_columns(table);
  if (const auto columns = fixed_columns(format)) return columns;
  if (format == TrackFormat::kitti) return kitti_columns(table);
  const TextLine& header = table.rows.front();
  auto columns = header_columns(header.text);
  if (format == TrackFormat::mot && !(columns && columns->format == format))
    return mot_columns(common_shape(table, true).cells);
  const bool fits =
      columns && (columns->format == format || (format == TrackFormat::csv && columns->format != TrackFormat::vru));
  if (!fits)
    throw FormatError(table.path, header.number, std::string(track_formats()[static_cast<std::size_t>(format)].columns),
                      excerpt(header.text));
  columns->format = format;
  return columns;
}

[[noreturn]] void reject_unknown(const TextTable& table) {
  const TextLine& first = table.rows.front();
  const Shape commas = common_shape(table, true);
  if (commas.cells >= 5 && commas.numbers == commas.cells)
    throw FormatError(table.path, first.number,
                      "a header line such as track_id,t,x,y, or 7, 9 or 10 columns as in MOTChallenge",
                      std::to_string(commas.cells) + " columns of numbers");
  const auto cells = cells_of(first.text, ' ');
  if (cells.size() >= 16 && !number_of(cells[0]) && number_of(cells[2]))
    throw FormatError(table.path, first.number, "a file of tracks",
                      "a line of one frame, as DeepStream writes; give the folder of its files");
  throw FormatError(table.path, first.number,
                    "tracks in a known format, such as CSV with the header line track_id,t,x,y",
                    excerpt(trimmed(first.text)));
}

}  // namespace

TextTable table_of(const std::string& path, std::string_view text, std::size_t first_line) {
  TextTable table{path, {}, {}};
  std::vector<TextLine> lines = lines_of(text, first_line);
  if (!lines.empty() && lines.front().text.starts_with("sep=")) lines.erase(lines.begin());  // of Excel
  const auto is_comment = [](const TextLine& line) { return trimmed(line.text).front() == '#'; };
  for (const TextLine& line : lines) {
    if (is_comment(line)) table.comments.push_back(lower(line.text));
  }
  std::erase_if(lines, is_comment);
  if (lines.empty()) throw FormatError(path, 0, "a file with rows", "comments only");
  table.rows = std::move(lines);
  return table;
}

std::optional<TrackColumns> columns_of(const TextTable& table, std::optional<TrackFormat> forced) {
  if (forced) return forced_columns(table, *forced);
  if (looks_like_ndjson(table)) return std::nullopt;
  const std::string_view first = table.rows.front().text;
  if (auto columns = header_columns(first)) return columns;
  auto columns = headerless_columns(table);
  if (!columns) reject_unknown(table);
  const auto cells = cells_of(first, columns->separator);
  if (std::ranges::any_of(cells, [](std::string_view cell) { return number_of(cell).has_value(); })) return columns;
  throw FormatError(table.path, table.rows.front().number,
                    "known names in the header line, such as track_id,t,x,y; or name the format with --format",
                    excerpt(trimmed(first)));
}

std::vector<std::string> column_warnings(const TextTable& table, const TrackColumns& columns) {
  if (!columns.header) return {};
  const std::string_view first = table.rows.front().text;
  const std::string start = table.path + ": ", names = excerpt(trimmed(first));
  const std::vector<std::string> cells = names_of(first, columns.separator);
  std::vector<std::string> warnings;
  const std::size_t used = columns.label ? 4 : 3;
  if (!columns.id && cells.size() > used)
    warnings.push_back(start + "no column of track ids in " + names + ", so all rows are one track; name it track_id");
  if (!columns.pixels && column(cells, {"w", "width"}) && column(cells, {"h", "height"}) && column(cells, {"x"}))
    warnings.push_back(start + "x, y in " + names +
                       " are points, their widths and heights are not used; name the edges of boxes x1,y1,x2,y2");
  return warnings;
}

std::vector<std::pair<std::string, std::string>> two_columns(const std::string& path, const std::string& text,
                                                             const char* first, const char* second) {
  const TextTable table = table_of(path, text);
  const TextLine& header = table.rows.front();
  const std::vector<std::string> names = names_of(header.text, ',');
  const auto a = column(names, {first}), b = column(names, {second});
  if (!a || !b)
    throw FormatError(path, header.number, std::string("a column ") + (a ? second : first), excerpt(header.text));
  std::vector<std::pair<std::string, std::string>> rows;
  for (std::size_t i = 1; i < table.rows.size(); ++i) {
    const auto cells = cells_of(table.rows[i].text, ',');
    if (cells.size() <= std::max(*a, *b))
      throw FormatError(path, table.rows[i].number, "as many cells as names", excerpt(table.rows[i].text));
    rows.emplace_back(cells[*a], cells[*b]);
  }
  return rows;
}

}  // namespace sila
