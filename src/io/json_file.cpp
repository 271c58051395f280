#include "json_file.hpp"

#include <algorithm>
#include <cmath>

#include "sila/core/errors.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

using Json = nlohmann::json;

bool is_finite_number(const Json& value) {
  return value.is_number() && std::isfinite(value.get<double>());
}

bool is_row(const Json& value, std::size_t columns) {
  return value.is_array() && value.size() == columns && std::ranges::all_of(value, is_finite_number);
}

/// Where a text in quotes or a comment that begins at `begin` ends: its last character. Elsewhere `begin` itself.
std::size_t end_of_token(std::string_view text, std::size_t begin) {
  const std::string_view rest = text.substr(begin);
  std::size_t end = begin;
  if (rest.starts_with("//")) end = text.find('\n', begin);
  if (rest.starts_with("/*")) end = std::min(text.find("*/", begin + 2), text.size() - 1) + 1;
  if (rest.starts_with('"')) {
    for (++end; end < text.size() && text[end] != '"'; ++end) {
      if (text[end] == '\\') ++end;
    }
  }
  return std::min(end, text.size());
}

/// Where brackets, but for those in texts and comments, are nested deeper than kDeepestJson; nothing if they are not.
std::optional<std::size_t> end_of_nesting(std::string_view text) {
  std::size_t depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    i = end_of_token(text, i);
    if (i >= text.size()) break;
    if ((text[i] == '[' || text[i] == '{') && ++depth > kDeepestJson) return i;
    if ((text[i] == ']' || text[i] == '}') && depth > 0) --depth;
  }
  return std::nullopt;
}

}  // namespace

nlohmann::json read_json(const std::filesystem::path& path) {
  return json_of_text(path.string(), read_text(path, "a JSON text"));
}

nlohmann::json shallow_json(std::string_view text) {
  return end_of_nesting(text) ? Json(Json::value_t::discarded) : Json::parse(text, nullptr, false);
}

const Json& member(const Json& object, const char* key) {
  static const Json none;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? none : *found;
}

std::string one_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::json json_of_text(const std::string& path, const std::string& text) {
  const auto line_of = [&](std::size_t offset) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(offset, text.size()));
    return static_cast<std::size_t>(std::count(text.begin(), end, '\n')) + 1;
  };
  if (const auto offset = end_of_nesting(text))
    throw FormatError(path, line_of(*offset), "JSON that is nested at most " + std::to_string(kDeepestJson) + " deep",
                      "a deeper one");
  try {
    return Json::parse(text, nullptr, true, true);
  } catch (const Json::parse_error& error) {
    const std::size_t end = text.find_last_not_of(" \t\r\n") + 1;  // of a text that is cut off: its last line
    throw FormatError(path, line_of(std::min(error.byte, end)), "JSON", excerpt(trimmed(text)));
  } catch (const Json::out_of_range& error) {
    // The exception has the number in quotes, but not its position: take the first position that has this number.
    const std::string_view said = error.what();
    const std::size_t begin = said.find('\'') + 1;
    const std::string_view number = said.substr(begin, said.rfind('\'') - begin);
    throw FormatError(path, line_of(text.find(number)), "JSON with finite numbers", excerpt(number));
  }
}

JsonFields::JsonFields(const Json& object, std::string file, std::string where)
    : object_(&object), file_(std::move(file)), where_(std::move(where)) {
  if (!object.is_object())
    throw FormatError(file_, 0, where_.empty() ? "a JSON object" : where_ + " a JSON object", excerpt(object.dump()));
}

bool JsonFields::has(const char* key) const {
  return !member(*object_, key).is_null();
}

void JsonFields::reject(const std::string& key, const std::string& expected) const {
  const auto found = object_->find(key);
  throw FormatError(file_, 0, where_ + key + " = " + expected,
                    found == object_->end() ? "no such field" : where_ + key + " = " + excerpt(found->dump()));
}

const Json& JsonFields::at(const char* key, const std::string& expected,
                           const std::function<bool(const Json&)>& fits) const {
  if (!has(key) || !fits(object_->at(key))) reject(key, expected);
  return object_->at(key);
}

double JsonFields::number(const char* key) const {
  return at(key, "a number", is_finite_number).get<double>();
}

double JsonFields::positive(const char* key) const {
  const auto fits = [](const Json& value) { return is_finite_number(value) && value.get<double>() > 0.0; };
  return at(key, "a positive number", fits).get<double>();
}

int JsonFields::whole(const char* key) const {
  const auto fits = [](const Json& value) { return value.is_number_integer() && std::abs(value.get<double>()) <= 1e9; };
  return at(key, "a whole number", fits).get<int>();
}

bool JsonFields::flag(const char* key) const {
  return at(key, "true or false", [](const Json& value) { return value.is_boolean(); }).get<bool>();
}

std::string JsonFields::text(const char* key) const {
  return at(key, "a text", [](const Json& value) { return value.is_string(); }).get<std::string>();
}

Vector2 JsonFields::point(const char* key) const {
  const Json& row = at(key, "[x, y]", [](const Json& value) { return is_row(value, 2); });
  return {row[0].get<double>(), row[1].get<double>()};
}

std::vector<std::vector<double>> JsonFields::rows(const char* key, std::size_t columns,
                                                  const std::string& expected) const {
  const auto is_one = [&](const Json& row) { return is_row(row, columns); };
  const auto fits = [&](const Json& value) { return value.is_array() && std::ranges::all_of(value, is_one); };
  return at(key, expected, fits).get<std::vector<std::vector<double>>>();
}

JsonFields JsonFields::object(const char* key) const {
  return {at(key, "an object", [](const Json&) { return true; }), file_, where_ + key + "."};
}

std::vector<JsonFields> JsonFields::objects(const char* key) const {
  std::vector<JsonFields> result;
  if (!has(key)) return result;
  const Json& array = at(key, "a list", [](const Json& value) { return value.is_array(); });
  for (std::size_t i = 0; i < array.size(); ++i)
    result.emplace_back(array[i], file_, where_ + key + "[" + std::to_string(i) + "].");
  return result;
}

std::vector<std::string> JsonFields::texts(const char* key) const {
  if (!has(key)) return {};
  const auto is_text = [](const Json& entry) { return entry.is_string(); };
  const auto fits = [&](const Json& value) { return value.is_array() && std::ranges::all_of(value, is_text); };
  return at(key, "a list of texts", fits).get<std::vector<std::string>>();
}

}  // namespace sila
