#include "street_plan.hpp"

#include <cmath>

namespace sila::sim {
namespace {

std::vector<Vector2> arms_of(Layout layout) {
  const Vector2 east(1.0, 0.0), north(0.0, 1.0), half(0.5, std::sqrt(0.75)), back(-0.5, std::sqrt(0.75));
  switch (layout) {
    case Layout::four_way:
      return {east, north, -east, -north};
    case Layout::t_junction:
      return {east, north, -east};
    case Layout::acute:
      return {east, half, -east, -half};
    case Layout::obtuse:
      return {east, back, -east, -back};
  }
  return {};
}

Block make_block(const Vector2& arm_1, const Vector2& arm_2, double half_road_m, double sidewalk_m) {
  Block block;
  block.inward_1 = left_of(arm_1);
  block.inward_2 = -left_of(arm_2);
  const double sine = cross(arm_1, arm_2);
  block.straight = std::abs(sine) < 1e-9;
  // The point at `half_road_m` from both centre lines: (arm_1 + arm_2) / sine is at distance 1 from each.
  block.origin =
      block.straight ? Vector2(half_road_m * block.inward_1) : Vector2((arm_1 + arm_2) * (half_road_m / sine));
  block.wall_corner = block.straight ? block.origin : Vector2(block.origin + (arm_1 + arm_2) * (sidewalk_m / sine));
  return block;
}

/// The places where legs meet: one at a corner, on a straight side one at the end of each of its two crosswalks.
struct Nodes {
  std::size_t at_arm_1 = 0;
  std::size_t at_arm_2 = 0;
};

std::vector<Nodes> number_nodes(const std::vector<Block>& blocks) {
  std::vector<Nodes> nodes;
  std::size_t next = 0;
  for (const Block& block : blocks) {
    const std::size_t first = next++;
    nodes.push_back({first, block.straight ? next++ : first});
  }
  return nodes;
}

void add_sidewalks(StreetPlan& plan, std::size_t k, const Nodes& nodes) {
  const Block& block = plan.blocks[k];
  const Vector2& arm_1 = plan.arms[k];
  const Vector2& arm_2 = plan.arms[(k + 1) % plan.arms.size()];
  plan.legs.push_back({block.origin, arm_1, block.inward_1, nodes.at_arm_1, std::nullopt, std::nullopt});
  plan.legs.push_back({block.origin, arm_2, block.inward_2, nodes.at_arm_2, std::nullopt, std::nullopt});
  if (block.straight)
    plan.legs.push_back({block.origin, arm_2, block.inward_2, nodes.at_arm_1, nodes.at_arm_2, std::nullopt});
}

/// A crosswalk prolongs the sidewalk of a corner over arm k, so that people who walk on go straight.
void add_crosswalk(StreetPlan& plan, std::size_t k, const std::vector<Nodes>& nodes) {
  const std::size_t count = plan.arms.size();
  const std::size_t before = (k + count - 1) % count;
  const Block& block = plan.blocks[k];
  Leg leg{block.origin, -plan.arms[(k + 1) % count], block.inward_2, nodes[k].at_arm_1, nodes[before].at_arm_2, k};
  if (block.straight) {
    leg.base = plan.blocks[before].origin;
    leg.direction = plan.arms[before];
    leg.inward = plan.blocks[before].inward_1;
  }
  plan.legs.push_back(leg);
}

}  // namespace

StreetPlan make_street_plan(const SimulationConfig& config) {
  StreetPlan plan;
  plan.arms = arms_of(config.layout);
  plan.half_road_m = 0.5 * config.road_width_m;
  plan.sidewalk_m = config.sidewalk_width_m;
  const std::size_t count = plan.arms.size();
  for (std::size_t k = 0; k < count; ++k)
    plan.blocks.push_back(make_block(plan.arms[k], plan.arms[(k + 1) % count], plan.half_road_m, plan.sidewalk_m));
  const std::vector<Nodes> nodes = number_nodes(plan.blocks);
  for (std::size_t k = 0; k < count; ++k) add_sidewalks(plan, k, nodes[k]);
  for (std::size_t k = 0; k < count; ++k) add_crosswalk(plan, k, nodes);
  return plan;
}

std::optional<std::size_t> block_of(const StreetPlan& plan, const Vector2& point) {
  for (std::size_t k = 0; k < plan.blocks.size(); ++k)
    if (depths(plan.blocks[k], point).minCoeff() >= 0.0) return k;
  return std::nullopt;
}

bool between_curbs(const StreetPlan& plan, std::size_t arm, const Vector2& point) {
  return std::abs(cross(plan.arms[arm], point)) < plan.half_road_m;
}

}  // namespace sila::sim
