#pragma once

#include <compare>
#include <cstdint>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Integer coordinates of a grid cell; the world has no border.
struct CellKey {
  std::int32_t x = 0;
  std::int32_t y = 0;
  auto operator<=>(const CellKey&) const = default;
};

/// The grid of a model, in curb coordinates; one and the same for the life of the model, or similarities between
/// episodes would mean nothing.
struct Grid {
  double cell = 1.0;                 ///< side of a cell [curb units]
  Vector2 origin = Vector2::Zero();  ///< lower corner of cell (0, 0)
  int tile_cells = 8;                ///< side of a tile [cells]; primitives are cut at tile borders (aligned cut)
  bool operator==(const Grid& other) const = default;
};

/// Largest distance of a cell from the grid's origin [cells]: its number and that of its tile must be integers.
inline constexpr double kFarthestCell = 1e9;

/// The cell that holds a point. Throws std::invalid_argument if the point is not finite or over 1e9 cells away.
CellKey cell_of(const Grid& grid, const Vector2& point);
/// The middle of a cell [curb units].
Vector2 centre_of(const Grid& grid, const CellKey& cell);
CellKey tile_of(const Grid& grid, const CellKey& cell);

/// Throws: std::invalid_argument unless the cell is 1e-6 to 1e6 curb units, the origin finite and at most 1e9 cells
/// away, and the tile 1 to 1,000,000 cells.
void validate(const Grid& grid);

}  // namespace sila
