#include "json_file.hpp"
#include "read_rows.hpp"

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

TrackFile read_detection_lines(const TextTable& table) {
  Detections result{table.path, {}};
  for (const TextLine& line : table.rows) {
    ++result.rows_read;
    const Json json = shallow_json(line.text);
    std::optional<Detection> row = detection_of(json);
    if (row) {
      row->line = line.number;
      result.rows.push_back(*std::move(row));
    } else {
      count_bad(result, json.is_object() ? DropReason::not_a_number : DropReason::not_json, line);
    }
  }
  return {std::move(result), TrackFormat::ndjson};
}

/// Its scenes may name the rate of the frames.
TrackFile read_trajnetpp(const TextTable& table, const ReadOptions& options) {
  Detections result{table.path, {}};
  std::optional<double> samples_per_second;
  for (const TextLine& line : table.rows) {
    const Json json = shallow_json(line.text);
    if (json.is_object() && json.contains("scene")) {
      const auto rate = number_in(json["scene"], "fps");
      if (rate && *rate > 0.0 && !samples_per_second) samples_per_second = rate;
      continue;
    }
    ++result.rows_read;
    const Json& track = member(json, "track");
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

}  // namespace

std::optional<Detection> detection_of(const nlohmann::json& json) {
  const auto id = id_in(json, "id");
  const auto t_s = number_in(json, "t"), x_m = number_in(json, "x"), y_m = number_in(json, "y");
  if (!id || id->empty() || id->size() > kMaxIdBytes || !t_s || !x_m || !y_m) return std::nullopt;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  for (const char* key : {"class", "label"}) {
    const Json& label = member(json, key);
    if (label.is_string()) row.label = label.get<std::string>();
    if (label.is_number()) row.label = label.dump();
  }
  return row;
}

TrackFile read_ndjson(const TextTable& table, const ReadOptions& options) {
  const bool stamped = table.rows.front().text.find("\"t\"") != std::string_view::npos;
  const TrackFormat format = options.format.value_or(stamped ? TrackFormat::ndjson : TrackFormat::trajnetpp);
  TrackFile file = format == TrackFormat::ndjson ? read_detection_lines(table) : read_trajnetpp(table, options);
  return in_metres(std::move(file), options);
}

}  // namespace sila
