
#include "json_file.hpp"
#include "read_rows.hpp"

namespace sila {
namespace {

using Json = nlohmann::json;

/// The number of a key; nothing if it is missing or something else.
std::optional<double> number_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional<double>(found->get<double>()) : std::nullopt;
}

/// The id of a track: a text or a whole number; nothing if it is missing or something else.
std::optional<std::string> id_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  if (found->is_string()) return found->get<std::string>();
  if (found->is_number_integer()) return found->dump();  // its digits, however large it is
  return std::nullopt;
}

}  // namespace

std::optional<Detection> detection_of(const nlohmann::json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto id = id_in(json, "id");
  const auto t_s = number_in(json, "t"), x_m = number_in(json, "x"), y_m = number_in(json, "y");
  if (!id || id->empty() || id->size() > kMaxIdBytes || !t_s || !x_m || !y_m) return std::nullopt;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  for (const char* key : {"class", "label"}) {
    const auto label = json.find(key);
    if (label != json.end() && label->is_string()) row.label = label->get<std::string>();
    if (label != json.end() && label->is_number()) row.label = label->dump();
  }
  return row;
}

Detections read_detection_lines(const TextTable& table) {
  Detections result{table.path, {}};
  for (const TextLine& line : table.rows) {
    ++result.rows_read;
    const Json json = shallow_json(line.text);
    std::optional<Detection> row = detection_of(json);
    if (row) {
      row->line = line.number;
      result.rows.push_back(*std::move(row));
    } else {
      count_bad(result.dropped, json.is_object() ? DropReason::not_a_number : DropReason::not_json, table.path,
                line.number, line.text);
    }
  }
  return result;
}

NdjsonRows read_trajnetpp(const TextTable& table) {
  NdjsonRows result{{table.path, {}}, {}};
  for (const TextLine& line : table.rows) {
    const Json json = shallow_json(line.text);
    if (json.is_object() && json.contains("scene")) {
      const auto rate = json["scene"].is_object() ? number_in(json["scene"], "fps") : std::nullopt;
      if (rate && *rate > 0.0 && !result.samples_per_second) result.samples_per_second = rate;
      continue;
    }
    ++result.detections.rows_read;
    if (!json.is_object() || !json.contains("track") || !json["track"].is_object()) {
      count_bad(result.detections.dropped, DropReason::not_json, table.path, line.number, line.text);
      continue;
    }
    const Json& track = json["track"];
    const auto id = id_in(track, "p");
    const auto frame = number_in(track, "f"), x = number_in(track, "x"), y = number_in(track, "y");
    if (id && frame && x && y)
      result.detections.rows.push_back({*id, *frame, Vector2(*x, *y), {}, line.number});
    else
      count_bad(result.detections.dropped, DropReason::not_a_number, table.path, line.number, line.text);
  }
  return result;
}

}  // namespace sila
