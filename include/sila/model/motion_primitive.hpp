#pragma once

#include <vector>

#include "sila/core/grid.hpp"

namespace sila {

/// The arrow of a motion primitive in one cell.
struct CellVelocity {
  CellKey cell;
  Vector2 velocity = Vector2::Zero();  ///< length <= 1: a direction, shortened where the members of a fusion disagree
};

/// A motion primitive: a local pattern of normalised velocities on the grid.
/// Invariant: cells sorted, each once; lengths in (0, 1].
struct MotionPrimitive {
  std::vector<CellVelocity> cells;
  double weight = 1.0;  ///< how many primitives of how many batches were fused into it
  int support = 0;      ///< lower bound of the number of different tracks that showed it
};

}  // namespace sila
