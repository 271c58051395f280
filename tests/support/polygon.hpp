#pragma once

#include "sila/sim/simulate.hpp"

namespace sila {

/// Whether a point lies inside (even-odd rule; the border may fall on either side).
inline bool contains(const Polygon& polygon, const Vector2& point) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vector2 a = polygon[i] - point, b = polygon[j] - point;
    if ((a.y() > 0.0) == (b.y() > 0.0)) continue;
    if (a.x() - a.y() * (b.x() - a.x()) / (b.y() - a.y()) > 0.0) inside = !inside;
  }
  return inside;
}

}  // namespace sila
