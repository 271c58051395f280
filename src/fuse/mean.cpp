#include "fuse/mean.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace sila {

MotionPrimitive mean_primitive(std::span<const MotionPrimitive* const> members, PrimitiveMean mean, double drop_below) {
  std::map<CellKey, Vector2> sums;
  double total = 0.0;
  MotionPrimitive result{{}, 0.0};
  for (const MotionPrimitive* member : members) {
    const double share = mean == PrimitiveMean::count ? member->weight : 1.0;
    for (const CellVelocity& arrow : member->cells)
      sums.try_emplace(arrow.cell, Vector2::Zero()).first->second += share * arrow.velocity;
    total += share;
    result.weight += member->weight;
  }
  double longest = 0.0;
  for (auto& [cell, sum] : sums) {
    sum /= total;
    longest = std::max(longest, sum.norm());
  }
  if (!(longest > 0.0)) throw std::invalid_argument("mean_primitive: members = none, or they cancel out in every cell");
  for (const auto& [cell, sum] : sums) {
    if (sum.norm() >= std::min(drop_below, longest) && !sum.isZero(0.0)) result.cells.push_back({cell, sum});
  }
  return result;
}

}  // namespace sila
