#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "core/concatenate.hpp"
#include "sila/evaluate/training_support.hpp"

namespace sila {
namespace {

std::pair<int, int> cell_at(double cell_m, const Vector2& position_m) {
  return {static_cast<int>(std::floor(position_m.x() / cell_m)), static_cast<int>(std::floor(position_m.y() / cell_m))};
}

}  // namespace

CoveredArea covered_area(std::span<const FramedTrajectory> tracks, double cell_m) {
  if (!(cell_m > 0.0))
    throw std::invalid_argument(concatenate("covered_area: cell_m = ", cell_m, ", must be positive"));
  std::set<std::pair<int, int>> touched, covered;
  for (const FramedTrajectory& placed : tracks) {
    for (const Vector2& position_m : placed.track.positions_m) touched.insert(cell_at(cell_m, position_m));
  }
  for (const auto& [x, y] : touched) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) covered.emplace(x + dx, y + dy);
    }
  }
  return {cell_m, {covered.begin(), covered.end()}};
}

bool contains(const CoveredArea& area, const Vector2& position_m) {
  return std::ranges::binary_search(area.cells, cell_at(area.cell_m, position_m));
}

}  // namespace sila
