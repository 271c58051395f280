#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace sila {

/// The number of a key; nothing if it is missing or something else.
inline std::optional<double> number_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional<double>(found->get<double>()) : std::nullopt;
}

/// The id of a track: a text or a whole number; nothing if it is missing or something else.
inline std::optional<std::string> id_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::nullopt;
  if (found->is_string()) return found->get<std::string>();
  if (found->is_number_integer()) return found->dump();  // its digits, however large it is
  return std::nullopt;
}

}  // namespace sila
