#include "fuse/mean.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace sila {
namespace {

struct Sum {
  Vector2 velocity = Vector2::Zero();
  double active = 0.0;  ///< members with an arrow here
};

}  // namespace

MotionPrimitive mean_primitive(std::span<const MotionPrimitive* const> members, PrimitiveMean mean, double drop_below) {
  std::map<CellKey, Sum> sums;
  double total = 0.0;
  MotionPrimitive result{{}, 0.0};
  for (const MotionPrimitive* member : members) {
    const double share = mean == PrimitiveMean::count ? member->weight : 1.0;
    for (const CellVelocity& arrow : member->cells) {
      sums[arrow.cell].velocity += share * arrow.velocity;
      sums[arrow.cell].active += 1.0;
    }
    total += share;
    result.weight += member->weight;
  }
  double longest = 0.0;
  for (auto& [cell, sum] : sums) {
    sum.velocity /= mean == PrimitiveMean::active ? sum.active : total;
    longest = std::max(longest, sum.velocity.norm());
  }
  if (!(longest > 0.0)) throw std::invalid_argument("mean_primitive: members = none, or they cancel out in every cell");
  for (const auto& [cell, sum] : sums) {
    if (sum.velocity.norm() >= std::min(drop_below, longest) && !sum.velocity.isZero(0.0)) {
      result.cells.push_back({cell, sum.velocity});
    }
  }
  return result;
}

}  // namespace sila
