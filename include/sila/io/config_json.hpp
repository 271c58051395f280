#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/io/files.hpp"

namespace sila {

/// One field of a configuration, with its type erased: its properties, and functions that read and write it.
struct Field {
  std::string path;  ///< dotted, as in fuse.similarity_threshold
  const char* unit;
  const char* text;
  Range range;                                       ///< of numbers; it lies within that of the member's type
  std::span<const char* const> choices;              ///< of choices
  std::function<nlohmann::json()> read;              ///< of a choice its name; a number may be infinite
  std::function<void(const nlohmann::json&)> write;  ///< takes a value of the type that `read` gives, checked
};

/// Throws: std::out_of_range for a value that has no name.
const char* choice_name(std::span<const char* const> names, std::size_t value);

/// The visitor that makes the list of all fields from `fields()`. The fields point into the configuration that was
/// visited.
class FieldCollector {
 public:
  template <class Number>
  void number(const char* name, Number& value, const Range& range, const char* unit, const char* text) {
    using Wide = std::conditional_t<std::is_integral_v<Number>, std::int64_t, double>;
    add(
        name, text, [&value] { return nlohmann::json(static_cast<Wide>(value)); },
        [&value](const nlohmann::json& given) { value = static_cast<Number>(given.get<Wide>()); });
    list_.back().unit = unit;
    list_.back().range = range;
  }
  void flag(const char* name, bool& value, const char* text) {
    add(
        name, text, [&value] { return nlohmann::json(value); },
        [&value](const nlohmann::json& given) { value = given.get<bool>(); });
  }
  template <class Enum>
  void choice(const char* name, Enum& value, std::span<const char* const> names, const char* text) {
    add(
        name, text, [&value, names] { return nlohmann::json(choice_name(names, static_cast<std::size_t>(value))); },
        [&value, names](const nlohmann::json& given) {
          value = static_cast<Enum>(std::ranges::find(names, given.get<std::string>()) - names.begin());
        });
    list_.back().choices = names;
  }
  template <class Group>
  void group(const char* name, Group& nested) {
    const std::string outer = std::exchange(prefix_, prefix_ + name + ".");
    fields(nested, *this);
    prefix_ = outer;
  }

  std::vector<Field> list() && { return std::move(list_); }

 private:
  void add(const char* name, const char* text, std::function<nlohmann::json()> read,
           std::function<void(const nlohmann::json&)> write);

  std::string prefix_;
  std::vector<Field> list_;
};

/// The fields of a configuration, in order; they point into it.
template <class Config>
std::vector<Field> collect_fields(Config& config) {
  FieldCollector collector;
  fields(config, collector);
  return std::move(collector).list();
}

/// A struct with fields() beside it.
template <class Config>
concept Configuration = requires(Config& config, FieldCollector& collector) {
  fields(config, collector);
};

/// One field of a configuration, as text.
struct FieldInfo {
  std::string path, value, unit, range, text;
};

/// The name that is nearest to `name` by edit distance. `known`: at least one.
std::string nearest_name(std::string_view name, std::span<const char* const> known);

// These do not depend on the type of the configuration; the templates below do the same for whole configurations.
nlohmann::ordered_json fields_to_json(std::span<const Field> list);
void fields_from_json(std::span<const Field> list, const nlohmann::json& json, std::string_view source);
void field_from_assignment(std::span<const Field> list, std::string_view assignment);
std::vector<FieldInfo> field_infos(std::span<const Field> list);

/// A configuration as nested JSON objects, in the order of its fields. Infinite numbers become "inf" and "-inf".
template <Configuration Config>
nlohmann::ordered_json to_json(Config config) {
  return fields_to_json(collect_fields(config));
}

/// The configuration with the values of a JSON object; what the object does not name stays. Groups are nested objects
/// or dotted keys. Throws: FormatError, naming `source` and the field, for an unknown key (with the nearest known one),
/// a value of another type, or one out of range.
template <Configuration Config>
Config apply_json(Config config, const nlohmann::json& json, std::string_view source) {
  fields_from_json(collect_fields(config), json, source);
  return config;
}

/// The configuration with one field set, from "path=value" as on the command line.
/// Throws: std::invalid_argument as apply_json does.
template <Configuration Config>
Config set_field(Config config, std::string_view assignment) {
  field_from_assignment(collect_fields(config), assignment);
  return config;
}

/// Path, value, unit, range and meaning of every field, in order.
template <Configuration Config>
std::vector<FieldInfo> list_fields(Config config) {
  return field_infos(collect_fields(config));
}

/// The list as aligned columns, one field a line, under a header.
std::string table(std::span<const FieldInfo> list);

}  // namespace sila
