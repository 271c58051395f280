#include "sila/core/grid.hpp"

#include <cmath>

#include "core/concatenate.hpp"

namespace sila {
namespace {

std::int32_t floor_divide(std::int32_t value, std::int32_t by) {
  return value >= 0 ? value / by : -((-value + by - 1) / by);
}

}  // namespace

CellKey cell_of(const Grid& grid, const Vector2& point) {
  const Vector2 scaled = (point - grid.origin) / grid.cell;
  if (!(scaled.cwiseAbs().maxCoeff() < kFarthestCell))
    throw invalid_argument("cell_of: point = (", point.x(), ", ", point.y(),
                           ") lies over 1e9 cells from the grid's origin");
  return {static_cast<std::int32_t>(std::floor(scaled.x())), static_cast<std::int32_t>(std::floor(scaled.y()))};
}

Vector2 centre_of(const Grid& grid, const CellKey& cell) {
  return grid.origin + grid.cell * Vector2(cell.x + 0.5, cell.y + 0.5);
}

CellKey tile_of(const Grid& grid, const CellKey& cell) {
  return {floor_divide(cell.x, grid.tile_cells), floor_divide(cell.y, grid.tile_cells)};
}

void validate(const Grid& grid) {
  if (!grid.origin.allFinite()) throw invalid_argument("grid: origin must be finite");
  if (!(grid.cell >= 1e-6 && grid.cell <= 1e6)) throw invalid_argument("grid: cell must be 1e-6 to 1e6 curb units");
  if (!(grid.origin.cwiseAbs().maxCoeff() <= kFarthestCell * grid.cell))
    throw invalid_argument("grid: origin is over 1e9 cells away");
  if (grid.tile_cells < 1 || grid.tile_cells > 1'000'000)
    throw invalid_argument("grid: tile_cells must be 1 to 1,000,000");
}

}  // namespace sila
