#pragma once

#include <span>
#include <utility>
#include <vector>

#include "sila/core/framed_trajectory.hpp"

namespace sila {

/// The ground that tracks cover: square cells of the world, sorted, each once.
struct CoveredArea {
  double cell_m = 1.0;
  std::vector<std::pair<int, int>> cells;
};

/// The cells of `cell_m` that the tracks touch, and all cells that border on one of them.
/// Throws: std::invalid_argument if `cell_m` is not positive.
CoveredArea covered_area(std::span<const FramedTrajectory> tracks, double cell_m = 1.0);

bool contains(const CoveredArea& area, const Vector2& position_m);

}  // namespace sila
