#include <algorithm>
#include <cmath>
#include <set>

#include "sila/evaluate/training_support.hpp"

namespace sila {
namespace {

std::pair<int, int> cell_at(const Vector2& position_m) {
  return {static_cast<int>(std::floor(position_m.x())), static_cast<int>(std::floor(position_m.y()))};
}

}  // namespace

CoveredArea covered_area(std::span<const FramedTrajectory> tracks) {
  std::set<std::pair<int, int>> touched, covered;
  for (const FramedTrajectory& placed : tracks) {
    for (const Vector2& position_m : placed.track.positions_m) touched.insert(cell_at(position_m));
  }
  for (const auto& [x, y] : touched) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) covered.emplace(x + dx, y + dy);
    }
  }
  return {covered.begin(), covered.end()};
}

bool contains(const CoveredArea& area, const Vector2& position_m) {
  return std::ranges::binary_search(area, cell_at(position_m));
}

}  // namespace sila
