#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "sila/core/trajectory.hpp"

namespace sila::detail {

/// To this number of decimals: a page is for reading.
inline double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  return std::round(value * scale) / scale + 0.0;  // + 0.0: no -0
}

/// x, y, x, y, ... of every `stride`-th point in centimetres; the last point is always among them.
inline nlohmann::ordered_json path_json(std::span<const Vector2> path_m, std::size_t stride = 1) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < path_m.size(); ++i) {
    if ((path_m.size() - 1 - i) % stride != 0) continue;
    json.insert(json.end(), {rounded(path_m[i].x(), 2), rounded(path_m[i].y(), 2)});
  }
  return json;
}

inline nlohmann::ordered_json point_json(const Vector2& point, int decimals = 4) {
  return {rounded(point.x(), decimals), rounded(point.y(), decimals)};
}

/// Bytes as text (RFC 4648).
inline std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace sila::detail
