#pragma once

#include <cmath>
#include <numbers>

#include "sila/model/model.hpp"

namespace sila {

/// Cells first .. last of one row, all with the same arrow.
inline MotionPrimitive row_of_arrows(int first, int last, double length = 1.0, double degrees = 0.0,
                                     double weight = 1.0) {
  const double angle = degrees * std::numbers::pi / 180.0;
  MotionPrimitive primitive{{}, weight};
  for (int x = first; x <= last; ++x) {
    primitive.cells.push_back({CellKey{x, 0}, length * Vector2(std::cos(angle), std::sin(angle))});
  }
  return primitive;
}

}  // namespace sila
