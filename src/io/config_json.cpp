#include "sila/io/config_json.hpp"

#include <charconv>
#include <cmath>
#include <numeric>

#include "core/concatenate.hpp"
#include "old_settings.hpp"
#include "sila/core/errors.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// A wrong value of a configuration. Callers convert it to an exception of their own.
struct Rejection {
  std::string expected;
  std::string found;
};

/// Edit distance of two words: insertions, deletions and replacements of letters (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t exchanged = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({exchanged, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

/// Index of the first word with the least edit distance to `name`, of which 64 letters count.
std::size_t nearest_word(std::string_view name, const std::vector<std::string_view>& words) {
  std::vector<std::size_t> distances;
  for (const std::string_view word : words) distances.push_back(edit_distance(name.substr(0, 64), word));
  return static_cast<std::size_t>(std::ranges::min_element(distances) - distances.begin());
}

/// A path with the present names of its parts.
std::string renamed(std::string_view path) {
  std::string result = "." + std::string(path) + ".";
  for (const auto& [before, now] : kRenamed) {
    const std::string part = "." + std::string(before) + ".";
    if (const std::size_t at = result.find(part); at != std::string::npos)
      result.replace(at, part.size(), "." + std::string(now) + ".");
  }
  return result.substr(1, result.size() - 2);
}

/// Whether a path or its end is the name of a field that is a constant now.
bool was_field(std::string_view path) {
  if (kConstants.find(" " + std::string(path) + " ") != std::string_view::npos) return true;
  const std::size_t dot = path.find('.');
  return dot != std::string_view::npos && was_field(path.substr(dot + 1));
}

const Field& find_field(std::span<const Field> list, std::string_view path) {
  if (list.empty()) throw std::invalid_argument("configuration: it has no fields");
  const auto known = std::ranges::find(list, path, &Field::path);
  if (known != list.end()) return *known;
  const std::string now = renamed(path);
  const auto has_new_name = [&](const Field& field) { return (field.path + ".").starts_with(now + "."); };
  if (now != path && std::ranges::any_of(list, has_new_name))
    throw Rejection{now + " (the new name of this field)", excerpt(path)};
  if (was_field(path)) throw Rejection{"a field that can be set (this one is a constant now)", excerpt(path)};
  std::vector<std::string_view> names;  // the whole path, and its last name alone, as users leave the group out
  for (const Field& field : list) {
    names.push_back(field.path);
    names.push_back(names.back().substr(field.path.rfind('.') + 1));
  }
  const std::size_t nearest = nearest_word(path, names);
  const bool is_near = 2 * edit_distance(path, names[nearest]) <= path.size();
  throw Rejection{is_near ? "a known field (the nearest is " + list[nearest / 2].path + ")"
                          : "a known field (`sila config` and sila.fields() list them)",
                  excerpt(path)};
}

std::string text_of(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.is_number_float() ? exact(value.get<double>()) : value.dump();
}

std::string kind_of(const Field& field) {
  if (!field.choices.empty()) return "one of " + joined(field.choices, " | ");
  const json present = field.read();
  return present.is_boolean() ? "true or false" : present.is_number_float() ? "a number" : "a whole number";
}

/// Writes a value of the right type into its field if the field admits it.
void write_checked(const Field& field, const json& value) {
  if (value.is_string() && std::ranges::find(field.choices, text_of(value)) == field.choices.end())
    throw Rejection{field.path + " to be " + kind_of(field), excerpt(text_of(value))};
  if (value.is_number() && !inside(field.range, value.get<double>()))
    throw Rejection{field.path + " in " + describe(field.range), text_of(value)};
  field.write(value);
}

/// A JSON value as the type of the field; null if it has another type.
json typed(const Field& field, const json& given) {
  const json present = field.read();
  if (!present.is_number()) return given.type() == present.type() ? given : json();
  if (present.is_number_float()) {
    if (given == "inf") return std::numeric_limits<double>::infinity();
    if (given == "-inf") return -std::numeric_limits<double>::infinity();
    return given.is_number() ? json(given.get<double>()) : json();
  }
  if (!given.is_number()) return json();
  if (given.type() == json::value_t::number_integer) return given;
  const double number = given.get<double>();  // 3.0 is a whole number, too
  if (std::trunc(number) != number || !(std::abs(number) < 9.2e18)) return json();
  return given.is_number_unsigned() ? given.get<std::int64_t>() : static_cast<std::int64_t>(number);
}

/// A value from the command line as the type of the field; null if it cannot be read as that.
json parsed(const Field& field, std::string_view given) {
  const json present = field.read();
  if (present.is_string()) return given;
  if (present.is_boolean()) {
    if (given == "true" || given == "1") return true;
    if (given == "false" || given == "0") return false;
    return json();
  }
  const auto read = [&](auto number) {
    const char* const end = given.data() + given.size();
    const auto [stop, error] = std::from_chars(given.data(), end, number);
    return error == std::errc() && stop == end ? json(number) : json();
  };
  return present.is_number_float() ? read(0.0) : read(std::int64_t{0});
}

void apply_object(std::span<const Field> list, const std::string& prefix, const json& object) {
  for (const auto& [key, value] : object.items()) {
    const std::string path = prefix + key;
    const std::string group = path + ".";
    if (std::ranges::any_of(list, [&](const Field& field) { return field.path.starts_with(group); })) {
      if (!value.is_object()) throw Rejection{path + " to be an object", value.dump()};
      apply_object(list, group, value);
      continue;
    }
    const Field& field = find_field(list, path);
    const json given = typed(field, value);
    if (given.is_null()) throw Rejection{field.path + " to be " + kind_of(field), value.dump()};
    write_checked(field, given);
  }
}

std::string range_of(const Field& field) {
  if (!field.choices.empty()) return joined(field.choices, " | ");
  if (field.read().is_boolean()) return "true | false";
  return std::isinf(field.range.min) && std::isinf(field.range.max) ? "any" : describe(field.range);
}

}  // namespace

const char* choice_name(std::span<const char* const> names, std::size_t value) {
  if (value < names.size()) return names[value];
  throw std::out_of_range("configuration: choice " + std::to_string(value) + " of " + std::to_string(names.size()));
}

void FieldCollector::add(const char* name, const char* text, std::function<json()> read,
                         std::function<void(const json&)> write) {
  list_.push_back({prefix_ + name, "", text, {}, {}, std::move(read), std::move(write)});
}

std::string nearest_name(std::string_view name, std::span<const char* const> known) {
  return known[nearest_word(name, {known.begin(), known.end()})];
}

ordered_json fields_to_json(std::span<const Field> list) {
  ordered_json root = ordered_json::object();
  for (const Field& field : list) {
    std::string path = "/" + field.path;
    std::ranges::replace(path, '.', '/');
    const json value = field.read();
    const bool is_infinite = value.is_number_float() && std::isinf(value.get<double>());  // JSON has no infinity
    root[ordered_json::json_pointer(path)] = is_infinite ? json(value > 0.0 ? "inf" : "-inf") : value;
  }
  return root;
}

void fields_from_json(std::span<const Field> list, const json& object, std::string_view source) {
  if (!object.is_object()) throw FormatError(std::string(source), 0, "a JSON object", object.type_name());
  try {
    apply_object(list, "", object);
  } catch (const Rejection& rejection) {
    throw FormatError(std::string(source), 0, rejection.expected, rejection.found);
  }
}

void field_from_assignment(std::span<const Field> list, std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw std::invalid_argument("set: expected path=value, found " + std::string(assignment));
  }
  const std::string_view given = assignment.substr(equals + 1);
  try {
    const Field& field = find_field(list, assignment.substr(0, equals));
    const json value = parsed(field, given);
    if (value.is_null()) throw Rejection{field.path + " to be " + kind_of(field), "\"" + std::string(given) + "\""};
    write_checked(field, value);
  } catch (const Rejection& rejection) {
    throw std::invalid_argument("set: expected " + rejection.expected + ", found " + rejection.found);
  }
}

std::vector<FieldInfo> field_infos(std::span<const Field> list) {
  std::vector<FieldInfo> infos;
  infos.reserve(list.size());
  for (const Field& field : list) {
    infos.push_back({field.path, text_of(field.read()), field.unit, range_of(field), field.text});
  }
  return infos;
}

std::string table(std::span<const FieldInfo> list) {
  std::vector<FieldInfo> rows(list.begin(), list.end());
  rows.insert(rows.begin(), FieldInfo{"field", "value", "unit", "range", "meaning"});
  for (const auto column : {&FieldInfo::path, &FieldInfo::value, &FieldInfo::unit, &FieldInfo::range}) {
    std::size_t widest = 0;
    for (const FieldInfo& row : rows) widest = std::max(widest, (row.*column).size());
    for (FieldInfo& row : rows) (row.*column).resize(widest + 2, ' ');
  }
  std::string text;
  for (const FieldInfo& row : rows) text += row.path + row.value + row.unit + row.range + row.text + '\n';
  return text;
}

}  // namespace sila
