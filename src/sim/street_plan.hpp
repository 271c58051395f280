#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/kinematics.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/sim/simulate.hpp"

namespace sila::sim {

/// How far a crosswalk is wider than the sidewalk it continues, on each side.
inline constexpr double kCrosswalkMargin_m = 0.5;

/// A city block: what lies behind both of its curbs. A straight sidewalk (the third side of a T) has two equal curbs.
struct Block {
  Vector2 origin;    ///< where the curb lines meet
  Vector2 inward_1;  ///< unit normals of the curbs, into the block
  Vector2 inward_2;
  Vector2 wall_corner;  ///< of the building; not of a straight block
  bool straight = false;
};

/// A straight strip to walk along, a sidewalk or a crosswalk, from `node_a` to `node_b` (none: it leads out of the
/// scene).
struct Leg {
  Vector2 base;       ///< a point of the edge from which the lateral position counts
  Vector2 direction;  ///< unit, from node_a to node_b
  Vector2 inward;     ///< unit, across the strip
  std::size_t node_a = 0;
  std::optional<std::size_t> node_b;
  std::optional<std::size_t> crossed_arm;  ///< a crosswalk over this arm
};

/// The walkable geometry of the intersection: arms (half streets) counter-clockwise round the centre, block k between
/// arms k and k + 1.
struct StreetPlan {
  std::vector<Vector2> arms;
  std::vector<Block> blocks;
  std::vector<Leg> legs;
  double half_road_m = 0.0;
  double sidewalk_m = 0.0;
};

StreetPlan make_street_plan(const SimulationConfig& config);

/// Distances of a point behind the two curbs of a block, positive inside.
inline Vector2 depths(const Block& block, const Vector2& point) {
  return {(point - block.origin).dot(block.inward_1), (point - block.origin).dot(block.inward_2)};
}

/// The block that holds a point; none on the roadway.
std::optional<std::size_t> block_of(const StreetPlan& plan, const Vector2& point);

/// Whether a point lies between the (prolonged) curbs of the street of an arm.
bool between_curbs(const StreetPlan& plan, std::size_t arm, const Vector2& point);

}  // namespace sila::sim
