#include "sila/sim/simulate.hpp"
#include "street_plan.hpp"

namespace sila {
namespace {

using sim::Block;
using sim::kCrosswalkMargin_m;
using sim::Leg;
using sim::StreetPlan;

constexpr double kCurbRounding_m = 1.2;  ///< where the drawn curb leaves the straight one, from the virtual corner
constexpr double kBlockDepth_m = 8.0;    ///< drawn depth of the buildings along a straight side

/// The bend of the curb, from the second arm to the first, as a parabola.
void append_rounded_curb(Polygon& polygon, const Vector2& origin, const Vector2& arm_1, const Vector2& arm_2) {
  for (int i = 0; i <= 6; ++i) {
    const double u = i / 6.0;
    polygon.push_back(origin + kCurbRounding_m * ((1.0 - u) * (1.0 - u) * arm_2 + u * u * arm_1));
  }
}

void add_block(IntersectionScene& scene, const StreetPlan& plan, std::size_t k, double length_m) {
  const Block& block = plan.blocks[k];
  const Vector2& arm_1 = plan.arms[k];
  const Vector2& arm_2 = plan.arms[(k + 1) % plan.arms.size()];
  const Vector2 far_1 = block.origin + length_m * arm_1, far_2 = block.origin + length_m * arm_2;
  const Vector2 wall_1 = far_1 + plan.sidewalk_m * block.inward_1, wall_2 = far_2 + plan.sidewalk_m * block.inward_2;
  if (block.straight) {
    scene.sidewalks.push_back({far_1, wall_1, wall_2, far_2});
    scene.buildings.push_back(
        {wall_1, wall_1 + kBlockDepth_m * block.inward_1, wall_2 + kBlockDepth_m * block.inward_2, wall_2});
    return;
  }
  Polygon sidewalk{far_1, wall_1, block.wall_corner, wall_2, far_2};
  append_rounded_curb(sidewalk, block.origin, arm_1, arm_2);
  scene.sidewalks.push_back(std::move(sidewalk));
  scene.buildings.push_back({block.wall_corner, wall_1, wall_1 + wall_2 - block.wall_corner, wall_2});
}

/// The parallelogram between the curbs of the crossed arm and the edges of the crosswalk.
Polygon crosswalk_area(const StreetPlan& plan, const Leg& leg) {
  const Vector2& arm = plan.arms[*leg.crossed_arm];
  Polygon area;
  const double near_m = -kCrosswalkMargin_m, far_m = plan.sidewalk_m + kCrosswalkMargin_m;
  for (const Vector2& at : {Vector2(-1.0, near_m), Vector2(-1.0, far_m), Vector2(1.0, far_m), Vector2(1.0, near_m)}) {
    const Vector2 edge = leg.base + at.y() * leg.inward;
    const double along = (at.x() * plan.half_road_m - cross(arm, edge)) / cross(arm, leg.direction);
    area.push_back(edge + along * leg.direction);
  }
  // `inward` of a crosswalk points along its arm, so this order is counter-clockwise for every arm.
  return area;
}

void add_corner(IntersectionScene& scene, const StreetPlan& plan, std::size_t k) {
  if (plan.blocks[k].straight) return;
  const Vector2& arm_2 = plan.arms[(k + 1) % plan.arms.size()];
  scene.corners.push_back({"corner_" + std::to_string(k + 1),
                           make_curb_frame(plan.blocks[k].origin, plan.arms[k], arm_2, plan.sidewalk_m)});
}

}  // namespace

IntersectionScene simulated_scene(const SimulationConfig& config) {
  validate_fields("simulate", config);
  const StreetPlan plan = sim::make_street_plan(config);
  IntersectionScene scene;
  scene.name = kLayoutNames[static_cast<std::size_t>(config.layout)];
  scene.sidewalk_width_m = config.sidewalk_width_m;
  scene.view_radius_m = config.view_radius_m;
  for (std::size_t k = 0; k < plan.blocks.size(); ++k) add_corner(scene, plan, k);
  for (std::size_t k = 0; k < plan.blocks.size(); ++k) add_block(scene, plan, k, config.view_radius_m + 10.0);
  for (const Leg& leg : plan.legs)
    if (leg.crossed_arm) scene.crosswalks.push_back(crosswalk_area(plan, leg));
  return scene;
}

}  // namespace sila
