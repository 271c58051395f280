#include <algorithm>
#include <set>
#include <utility>

#include "core/dropped_rows.hpp"
#include "json_file.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

using Json = nlohmann::json;

/// The number of a key; nothing if it is missing or something else.
std::optional<double> number_in(const Json& object, const char* key) {
  const Json& value = member(object, key);
  return value.is_number() ? std::optional<double>(value.get<double>()) : std::nullopt;
}

/// The id of a track: a text or a whole number; nothing if it is missing or something else.
std::optional<std::string> id_in(const Json& object, const char* key) {
  const Json& value = member(object, key);
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer()) return value.dump();  // its digits, however large it is
  return std::nullopt;
}

/// A detection, `{"t": 12.3, "id": "a", "x": 1.5, "y": 2.0}`; null for any other JSON.
std::optional<Detection> detection_of(const Json& object) {
  const auto id = id_in(object, "id");
  const auto t_s = number_in(object, "t"), x_m = number_in(object, "x"), y_m = number_in(object, "y");
  if (!id || id->empty() || id->size() > kMaxIdBytes || !t_s || !x_m || !y_m) return std::nullopt;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  for (const char* key : {"class", "label"}) {
    const Json& label = member(object, key);
    if (label.is_string()) row.label = label.get<std::string>();
    if (label.is_number()) row.label = label.dump();
  }
  return row;
}

TrackFile read_detection_lines(const TextTable& table) {
  Detections result{table.path, {}};
  for (const TextLine& line : table.rows) {
    ++result.rows_read;
    const Json object = shallow_json(line.text);
    if (std::optional<Detection> row = detection_of(object)) {
      row->line = line.number;
      result.rows.push_back(*std::move(row));
    } else {
      count_bad(result, object.is_object() ? DropReason::not_a_number : DropReason::not_json, line);
    }
  }
  return {std::move(result), TrackFormat::ndjson};
}

/// Its scenes may name the rate of the frames.
TrackFile read_trajnetpp(const TextTable& table, const ReadOptions& options) {
  Detections result{table.path, {}};
  std::optional<double> samples_per_second;
  for (const TextLine& line : table.rows) {
    const Json object = shallow_json(line.text);
    if (object.is_object() && object.contains("scene")) {
      const auto rate = number_in(object["scene"], "fps");
      if (rate && *rate > 0.0 && !samples_per_second) samples_per_second = rate;
      continue;
    }
    ++result.rows_read;
    const Json& track = member(object, "track");
    if (!track.is_object()) {
      count_bad(result, DropReason::not_json, line);
      continue;
    }
    const auto id = id_in(track, "p");
    const auto frame = number_in(track, "f"), x = number_in(track, "x"), y = number_in(track, "y");
    if (id && frame && x && y)
      result.rows.push_back({*id, *frame, Vector2(*x, *y), {}, line.number});
    else
      count_bad(result, DropReason::not_a_number, line);
  }
  const ReadOptions stated{.sample_interval_s = 1.0 / samples_per_second.value_or(2.5)};
  return with_seconds({std::move(result), TrackFormat::trajnetpp}, first_of(options, stated));
}

/// The elements of the JSON array that begins at `at`, each with the line on which it begins. Throws: FormatError if
/// the array does not end, or if it is the whole text (`at` = 0) and ends before the text.
std::vector<TextLine> elements_of(const std::string& path, std::string_view text, std::size_t at = 0) {
  std::vector<TextLine> elements;
  std::size_t line = 1 + static_cast<std::size_t>(std::ranges::count(text.substr(0, at), '\n'));
  std::size_t begin = at, begin_line = 0, depth = 0;  // begin_line 0: only blanks since `begin`
  bool quoted = false;
  const auto end_element = [&](std::size_t end) {
    if (begin_line > 0) elements.push_back({trimmed(text.substr(begin, end - begin)), begin_line});
    begin = end + 1;
    begin_line = 0;
  };
  for (std::size_t i = at; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    const bool ends = !quoted && ((c == ',' && depth == 1) || ((c == ']' || c == '}') && --depth == 0));
    if (ends) {
      end_element(i);
    } else if (depth > 0 && begin_line == 0 && !trimmed(text.substr(i, 1)).empty()) {
      begin_line = line;
    }
    if (ends && depth == 0) {
      const std::string_view rest = trimmed(text.substr(c == ']' ? i + 1 : i));
      if (rest.empty() || at > 0) return elements;
      throw FormatError(path, line, "the end of the file after a JSON array", excerpt(rest));
    }
    if (quoted && c == '\\') ++i;
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == '[' || c == '{') && ++depth == 1) begin = i + 1;
  }
  throw FormatError(path, line, "a JSON array that is whole", "the end of the file");
}

/// A value as the cell of a table; arrays, objects and null are empty.
std::string json_cell(const Json& value) {
  if (value.is_number() || value.is_boolean()) return value.dump();
  std::string text = value.is_string() ? value.get<std::string>() : std::string();
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == '"'; }, ' ');
  return text;
}

/// The rows of a table made of JSON objects, each with the line of its object, and what is no such object.
struct JsonTable {
  Detections bad = {};  ///< counts alone
  std::string rows = {};
  std::vector<std::size_t> lines = {};

  void add(const std::vector<Json>& values, std::size_t line) {
    rows += '0';  // neither blank nor a comment, whatever the first value is
    for (const Json& value : values) rows += '\t' + json_cell(value);
    rows += '\n';
    lines.push_back(line);
  }
  void reject(const TextLine& element, DropReason reason = DropReason::not_json) {
    count_bad(bad, reason, element);
    ++bad.rows_read;
  }
  TextTable table() const {
    TextTable result{bad.source, lines_of(rows), {}};
    for (std::size_t i = 0; i < lines.size(); ++i) result.rows[i].number = lines[i];
    return result;
  }
  TrackFile with_bad_rows(TrackFile file) const {
    file.detections.rows_read += bad.rows_read;
    sila::add(file.detections.dropped, bad.dropped);
    return file;
  }
};

/// Where the value of a key begins, if it begins with `opener`; npos if there is no such key.
std::size_t value_of_key(std::string_view text, const std::string& key, char opener) {
  const std::string quoted = '"' + key + '"';
  for (std::size_t at = text.find(quoted); at != std::string_view::npos; at = text.find(quoted, at + 1)) {
    const std::size_t colon = text.find_first_not_of(" \t\r\n", at + quoted.size());
    if (colon == std::string_view::npos || text[colon] != ':') continue;
    const std::size_t value = text.find_first_not_of(" \t\r\n", colon + 1);
    if (value != std::string_view::npos && text[value] == opener) return value;
  }
  return std::string_view::npos;
}

bool has_key(std::string_view text, const std::string& key, char opener) {
  return value_of_key(text, key, opener) != std::string_view::npos;
}

/// A coordinate plus `share` of a length; null if one is not a number.
Json shifted(const Json& coordinate, const Json& length, double share) {
  if (!coordinate.is_number() || !length.is_number()) return {};
  return coordinate.get<double>() + share * length.get<double>();
}

/// Track, time, left, top, right and bottom edge, class: the cells of box_columns. Null for JSON of another structure.
using BoxRows = std::optional<std::vector<std::vector<Json>>>;

BoxRows frigate_rows(const Json& event) {
  const Json& after = member(event, "after");
  const Json& box = member(after, "box");
  if (!after.is_object() || !box.is_array() || box.size() != 4) return std::nullopt;
  return {{{member(after, "id"), member(after, "frame_time"), box[0], box[1], box[2], box[3], member(after, "label")}}};
}

std::string camera_of_event(const Json& event) {
  return json_cell(member(member(event, "after"), "camera"));
}

BoxRows axis_rows(const Json& message) {
  const Json& frame = member(message.contains("data") ? member(message, "data") : message, "frame");
  const Json& observations = member(frame, "observations");
  if (!observations.is_array()) return std::nullopt;
  BoxRows rows(std::in_place);
  for (const Json& seen : observations) {
    const Json& box = member(seen, "bounding_box");
    const Json& type = member(member(seen, "class"), "type");
    rows->push_back({member(seen, "track_id"), member(frame, "timestamp"), member(box, "left"), member(box, "top"),
                     member(box, "right"), member(box, "bottom"), type.is_string() ? type : Json("unknown")});
  }
  return rows;
}

BoxRows ottrk_rows(const Json& seen) {
  const Json &x = member(seen, "x"), &y = member(seen, "y");
  if (!seen.is_object()) return std::nullopt;
  return {{{member(seen, "track-id"), member(seen, "occurrence"), x, y, shifted(x, member(seen, "w"), 1.0),
            shifted(y, member(seen, "h"), 1.0), member(seen, "class")}}};
}

/// Files of OTVision until version 1.0 of its detections have the centres of boxes instead of their corners.
bool has_centres(std::string_view text) {
  const std::size_t at = std::min(value_of_key(text, "otdet_version", '"'), text.size());
  return text.substr(at).starts_with("\"0") || text.substr(at).starts_with("\"1.0\"");
}

void move_to_corner(Json& seen) {
  if (!seen.is_object()) return;
  seen["x"] = shifted(member(seen, "x"), member(seen, "w"), -0.5);
  seen["y"] = shifted(member(seen, "y"), member(seen, "h"), -0.5);
}

BoxRows opendatacam_rows(const Json& frame) {
  const Json& objects = member(frame, "objects");
  if (!objects.is_array()) return std::nullopt;
  BoxRows rows(std::in_place);
  for (const Json& seen : objects) {
    const Json &x = member(seen, "x"), &y = member(seen, "y"), &w = member(seen, "w"), &h = member(seen, "h");
    rows->push_back({member(seen, "id"), member(frame, "timestamp"), shifted(x, w, -0.5), shifted(y, h, -0.5),
                     shifted(x, w, 0.5), shifted(y, h, 0.5), member(seen, "name")});
  }
  return rows;
}

BoxRows box_rows(TrackFormat format, const Json& object) {
  if (format == TrackFormat::frigate) return frigate_rows(object);
  if (format == TrackFormat::axis) return axis_rows(object);
  return format == TrackFormat::ottrk ? ottrk_rows(object) : opendatacam_rows(object);
}

TrackColumns box_columns(TrackFormat format) {
  return {.format = format,
          .separator = '\t',
          .id = 1,
          .time = 2,
          .x = 3,
          .y = 4,
          .x2 = 5,
          .y2 = 6,
          .foot = true,
          .pixels = true,
          .label = 7,
          .cells = 8};
}

/// Adds the boxes of an element of a file to the table, or counts it among the bad ones; false for another structure.
bool add_boxes(JsonTable& table, const TextLine& element, const Json& object, TrackFormat format,
               const ReadOptions& options) {
  const BoxRows rows = object.is_object() ? box_rows(format, object) : std::nullopt;
  if (!rows) table.reject(element);
  if (!rows) return false;
  const std::string camera = format == TrackFormat::frigate ? camera_of_event(object) : std::string();
  if (format == TrackFormat::frigate && options.frigate_camera.value_or(camera) != camera)
    table.reject({camera, element.number}, DropReason::other_camera);
  else
    for (const std::vector<Json>& row : *rows) table.add(row, element.number);
  return true;
}

TrackFile boxes_in(const JsonTable& table, TrackFormat format, const ReadOptions& options) {
  return table.with_bad_rows(read_table(table.table(), {box_columns(format), options, {}, {}}, {}));
}

/// The objects of a file of tracked boxes: lines, or the elements of the array that has them.
std::vector<TextLine> box_elements(const std::string& path, std::string_view text, TrackFormat format) {
  if (format == TrackFormat::frigate || format == TrackFormat::axis) return table_of(path, text).rows;
  if (format == TrackFormat::opendatacam && is_json_array(text)) return elements_of(path, text);
  const std::size_t detections = value_of_key(text, "detections", '[');
  if (format == TrackFormat::ottrk && detections != std::string_view::npos) return elements_of(path, text, detections);
  throw FormatError(path, 1, std::string(track_formats()[static_cast<std::size_t>(format)].columns),
                    excerpt(trimmed(text.substr(0, 4096))));
}

}  // namespace

bool is_json_array(std::string_view text) {
  return trimmed(text.substr(0, 4096)).starts_with('[');
}

std::optional<TrackFormat> json_boxes_format(std::string_view text, std::optional<TrackFormat> forced) {
  using enum TrackFormat;
  if (forced)
    return *forced == frigate || *forced == axis || *forced == ottrk || *forced == opendatacam ? forced : std::nullopt;
  const std::string_view head = trimmed(text.substr(0, 4096));
  const std::string_view line = head.substr(0, head.find('\n'));
  if (head.starts_with('[')) return has_key(head, "objects", '[') ? std::optional(opendatacam) : std::nullopt;
  if (!head.starts_with('{')) return std::nullopt;
  if (trimmed(head.substr(1)).starts_with("\"metadata\"")) return ottrk;
  if (has_key(line, "before", '{') || has_key(line, "after", '{')) return frigate;
  return has_key(line, "frame", '{') && has_key(line, "observations", '[') ? std::optional(axis) : std::nullopt;
}

TrackFile read_json_boxes(const std::string& path, std::string_view text, TrackFormat format,
                          const ReadOptions& options) {
  JsonTable table{.bad = {path, {}}};
  const bool centred = format == TrackFormat::ottrk && has_centres(text);
  std::set<std::string> cameras;
  for (const TextLine& element : box_elements(path, text, format)) {
    Json object = shallow_json(element.text);
    if (centred) move_to_corner(object);
    const bool counts = add_boxes(table, element, object, format, options) && !options.frigate_camera;
    if (counts && format == TrackFormat::frigate) cameras.insert(camera_of_event(object));
  }
  TrackFile file = boxes_in(table, format, options);
  if (cameras.size() > 1)
    file.detections.warnings.push_back(path + ": events of " + std::to_string(cameras.size()) +
                                       " cameras, taken as one picture; give --frigate-camera");
  return file;
}

std::optional<TrackFile> live_detections(const nlohmann::json& object, const ReadOptions& options) {
  if (std::optional<Detection> row = detection_of(object))
    return in_metres({{{}, {*std::move(row)}, 1}, TrackFormat::ndjson}, options);
  JsonTable table;
  for (const TrackFormat format : {TrackFormat::frigate, TrackFormat::axis}) {
    if (!object.is_object() || !box_rows(format, object)) continue;
    add_boxes(table, {}, object, format, options);
    return boxes_in(table, format, options);
  }
  return std::nullopt;
}

TrackFile read_ndjson(const TextTable& table, const ReadOptions& options) {
  const TextLine& first = table.rows.front();
  const auto has = [&](std::string_view key) { return first.text.find(key) != std::string_view::npos; };
  if (has("\"t0\"") && has("\"modes\""))
    throw FormatError(
        table.path, first.number, "tracks",
        "predictions of sila; give the tracks of which they were made (sila evaluate TRACKS --predictions "
        "FILE scores predictions)");
  const TrackFormat format = options.format.value_or(has("\"t\"") ? TrackFormat::ndjson : TrackFormat::trajnetpp);
  TrackFile file = format == TrackFormat::ndjson ? read_detection_lines(table) : read_trajnetpp(table, options);
  return in_metres(std::move(file), options);
}

TrackFile read_json_array(const std::string& path, std::string_view text, const ReadOptions& options,
                          const std::string& only_track) {
  const std::vector<TextLine> elements = elements_of(path, text);
  // An object may lack names, as detectors leave out the id of a new track. Objects are parsed twice, because all of
  // them take many times the memory of the text.
  std::set<std::string> names;
  std::size_t first_line = 0;
  for (const TextLine& element : elements) {
    const Json object = shallow_json(element.text);
    if (object.is_object() && first_line == 0) first_line = element.number;
    if (object.is_object())
      for (const auto& [name, value] : object.items()) names.insert(name);
  }
  if (first_line == 0) throw FormatError(path, 1, "a JSON array of objects, one a detection", "none");
  JsonTable objects{.bad = {path, {}}, .rows = "object", .lines = {first_line}};
  for (const std::string& name : names) objects.rows += '\t' + json_cell(name);
  std::ranges::replace_if(
      objects.rows, [](char c) { return c == ',' || c == ';'; }, ' ');  // tabs separate
  objects.rows += '\n';
  for (const TextLine& element : elements) {
    const Json object = shallow_json(element.text);
    std::vector<Json> values;
    for (const std::string& name : names) values.push_back(member(object, name.c_str()));
    if (object.is_object())
      objects.add(values, element.number);
    else
      objects.reject(element);
  }
  const TextTable table = objects.table();
  const auto reader = table_reader(table, options);
  if (!reader)
    throw FormatError(path, 1, std::string("lines of format ") + std::string(name_of(*options.format)), "a JSON array");
  return objects.with_bad_rows(read_table(table, *reader, only_track));
}

}  // namespace sila
