#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <span>

#include "walker.hpp"

namespace sila::sim {
namespace {

constexpr double kOutside_m = 4.0;    ///< ways begin and end this far out of view
constexpr double kShyOfWall_m = 0.7;  ///< distance that people keep from the building
constexpr double kShyOfCurb_m = 0.5;
constexpr std::size_t kMostCrossings = 2;

/// A leg as walked: the straight line at `lateral_m` from the edge of the strip.
struct Stretch {
  std::size_t leg = 0;
  bool forward = true;
  double lateral_m = 0.0;
};

Vector2 point_of(const StreetPlan& plan, const Stretch& stretch) {
  const Leg& leg = plan.legs[stretch.leg];
  return leg.base + stretch.lateral_m * leg.inward;
}

Vector2 heading_of(const StreetPlan& plan, const Stretch& stretch) {
  return stretch.forward ? plan.legs[stretch.leg].direction : Vector2(-plan.legs[stretch.leg].direction);
}

/// The lateral position of a person, who keeps to the right of the strip.
double draw_lateral(const StreetPlan& plan, std::size_t leg, bool forward, Random& random) {
  const Vector2 heading = forward ? plan.legs[leg].direction : Vector2(-plan.legs[leg].direction);
  const double right = cross(heading, plan.legs[leg].inward) > 0.0 ? -1.0 : 1.0;
  const double lateral = 0.5 * plan.sidewalk_m + 0.3 * right + 0.5 * random.normal();
  return std::clamp(lateral, kShyOfCurb_m, plan.sidewalk_m - kShyOfWall_m);
}

template <class Weight>
std::size_t draw_index(std::size_t count, Weight weight, Random& random) {
  double total = 0.0;
  for (std::size_t i = 0; i < count; ++i) total += weight(i);
  double left = random.uniform() * total;
  for (std::size_t i = 0; i < count; ++i) {
    left -= weight(i);
    if (left < 0.0 && weight(i) > 0.0) return i;
  }
  return count;
}

/// Draws the end of a sidewalk where a person begins, mostly one of the corner in view.
Stretch draw_start(const StreetPlan& plan, Random& random) {
  const auto weight = [&](std::size_t i) {
    const Leg& leg = plan.legs[i];
    if (leg.node_b) return 0.0;
    const double distance = (leg.base - plan.blocks.front().origin).norm();
    return distance < 1.0 ? 3.0 : (distance < 1.5 * 2.0 * plan.half_road_m ? 1.0 : 0.4);
  };
  const std::size_t leg = draw_index(plan.legs.size(), weight, random);
  return {leg, false, draw_lateral(plan, leg, false, random)};
}

struct Draft {
  std::vector<Stretch> stretches;
  std::vector<std::size_t> nodes;
};

/// The relative probability that a walker continues along leg `i`; 0 for legs that do not start here or lead back.
double leg_weight(const StreetPlan& plan, const SimulationConfig& config, const Draft& draft, std::size_t i) {
  const Leg& leg = plan.legs[i];
  const std::size_t node = draft.nodes.back();
  const Stretch& last = draft.stretches.back();
  const bool forward = leg.node_a == node;
  if (i == last.leg || (!forward && leg.node_b != node)) return 0.0;
  const auto target = forward ? leg.node_b : std::optional<std::size_t>(leg.node_a);
  if (target && std::ranges::find(draft.nodes, *target) != draft.nodes.end()) return 0.0;
  const bool ahead = std::abs(cross(leg.direction, plan.legs[last.leg].direction)) < 1e-9;
  const auto crossed = static_cast<std::size_t>(std::ranges::count_if(
      draft.stretches, [&](const Stretch& s) { return plan.legs[s.leg].crossed_arm.has_value(); }));
  if (leg.crossed_arm && crossed >= kMostCrossings) return 0.0;
  if (plan.legs[last.leg].crossed_arm) return leg.crossed_arm ? 0.15 : (ahead ? 0.5 : 0.35);
  if (!leg.crossed_arm) return config.turn_share;
  return (1.0 - config.turn_share) * (ahead ? 0.65 : 0.35);
}

Draft draw_legs(const StreetPlan& plan, const SimulationConfig& config, Random& random) {
  Draft draft;
  draft.stretches.push_back(draw_start(plan, random));
  draft.nodes.push_back(plan.legs[draft.stretches.front().leg].node_a);
  while (true) {
    const auto weight = [&](std::size_t i) { return leg_weight(plan, config, draft, i); };
    const std::size_t i = draw_index(plan.legs.size(), weight, random);
    if (i == plan.legs.size()) return draw_legs(plan, config, random);  // a dead end: draw anew
    const Leg& leg = plan.legs[i];
    const Stretch& last = draft.stretches.back();
    const bool forward = leg.node_a == draft.nodes.back();
    const bool ahead = std::abs(cross(leg.direction, plan.legs[last.leg].direction)) < 1e-9;
    draft.stretches.push_back({i, forward, ahead ? last.lateral_m : draw_lateral(plan, i, forward, random)});
    if (forward && !leg.node_b) return draft;
    draft.nodes.push_back(forward ? *leg.node_b : leg.node_a);
  }
}

/// The sidewalk along `arm` that leads out from a node.
std::optional<std::size_t> sidewalk_along(const StreetPlan& plan, std::size_t arm, std::size_t node) {
  for (std::size_t i = 0; i < plan.legs.size(); ++i) {
    const Leg& leg = plan.legs[i];
    if (leg.node_a == node && !leg.node_b && (leg.direction - plan.arms[arm]).norm() < 1e-9) return i;
  }
  return std::nullopt;
}

/// Moves a crossing out along its arm, to where a person who comes along that arm may leave the sidewalk early.
/// Returns the leg of the crossing, or none if no crossing of this way can be moved.
std::optional<std::size_t> leave_crosswalk(const StreetPlan& plan, Draft& draft, Random& random) {
  for (std::size_t i = 1; i + 1 < draft.stretches.size(); ++i) {
    const std::size_t crossing = draft.stretches[i].leg;
    if (!plan.legs[crossing].crossed_arm) continue;
    const std::size_t arm = *plan.legs[crossing].crossed_arm;
    const auto before = sidewalk_along(plan, arm, draft.nodes[i - 1]);
    const auto behind = sidewalk_along(plan, arm, draft.nodes[i]);
    if (!before || !behind || draft.stretches[i - 1].leg != *before) continue;
    draft.stretches[i].lateral_m = plan.sidewalk_m + random.uniform(1.5, 7.0);
    if (draft.stretches[i + 1].leg != *behind)
      draft.stretches.insert(std::next(draft.stretches.begin(), static_cast<std::ptrdiff_t>(i) + 1),
                             {*behind, false, draw_lateral(plan, *behind, false, random)});
    return crossing;
  }
  return std::nullopt;
}

/// Where a sidewalk that leads out of the scene is left or entered, out of view.
Vector2 outer_end(const StreetPlan& plan, const SimulationConfig& config, const Stretch& stretch) {
  const Vector2 offset = point_of(plan, stretch) - plan.blocks.front().origin;
  const Vector2& direction = plan.legs[stretch.leg].direction;
  const double radius = config.view_radius_m + kOutside_m;
  const double along = offset.dot(direction);
  const double inside = radius * radius - offset.squaredNorm() + along * along;
  return point_of(plan, stretch) +
         std::max(3.0 + plan.sidewalk_m, std::sqrt(std::max(inside, 0.0)) - along) * direction;
}

/// The corners of the way before rounding; `before[i]` is the stretch that leads to vertex i.
struct Vertices {
  std::vector<Vector2> points;
  std::vector<std::size_t> before;
};

Vertices to_vertices(const StreetPlan& plan, const SimulationConfig& config, const std::vector<Stretch>& stretches) {
  Vertices vertices;
  vertices.points.push_back(outer_end(plan, config, stretches.front()));
  vertices.before.push_back(0);
  for (std::size_t i = 0; i + 1 < stretches.size(); ++i) {
    const Vector2 a = heading_of(plan, stretches[i]), b = heading_of(plan, stretches[i + 1]);
    const double sine = cross(a, b);
    if (std::abs(sine) < 1e-9) continue;
    const Vector2 from = point_of(plan, stretches[i]), to = point_of(plan, stretches[i + 1]);
    vertices.points.push_back(from + (cross(to - from, b) / sine) * a);
    vertices.before.push_back(i);
  }
  vertices.points.push_back(outer_end(plan, config, stretches.back()));
  vertices.before.push_back(stretches.size() - 1);
  return vertices;
}

/// How far before and behind a vertex the way may leave its two lines: not through the building, nor over the curb
/// beside the crosswalk.
double bend_length(const StreetPlan& plan, const std::vector<Stretch>& stretches, const Vertices& vertices,
                   std::size_t i, double wish_m) {
  const Vector2& at = vertices.points[i];
  const Vector2 in = (at - vertices.points[i - 1]).normalized(), out = (vertices.points[i + 1] - at).normalized();
  double bend =
      std::min({wish_m, 0.45 * (at - vertices.points[i - 1]).norm(), 0.45 * (vertices.points[i + 1] - at).norm()});
  const auto block = block_of(plan, at);
  if (!block) return std::min(bend, 0.5);
  const Vector2 depth = depths(plan.blocks[*block], at);
  const bool from_road = plan.legs[stretches[vertices.before[i]].leg].crossed_arm.has_value();
  const bool to_road = plan.legs[stretches[vertices.before[i] + 1].leg].crossed_arm.has_value();
  if (from_road && to_road) return std::max(0.2, std::min(bend, depth.minCoeff()));
  if (from_road || to_road) return std::max(0.3, std::min(bend, depth.minCoeff() + 0.3));
  // Half the angle between the two lines: the bend passes cos(half) * bend / 2 inside the vertex, the building corner
  // lies (sidewalk - depth) / sin(half) inside it.
  const double cosine = -in.dot(out);
  const double half_sine = std::sqrt(0.5 * (1.0 - cosine)), half_cosine = std::sqrt(0.5 * (1.0 + cosine));
  const double room = (plan.sidewalk_m - depth.maxCoeff()) / half_sine - kShyOfWall_m;
  return std::max(0.3, std::min(bend, 2.0 * room / std::max(half_cosine, 1e-3)));
}

std::vector<Vector2> resample(const std::vector<Vector2>& line) {
  std::vector<Vector2> path{line.front()};
  double rest = kPathStep_m;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double length = (line[i] - line[i - 1]).norm();
    double at = rest;
    for (; at <= length; at += kPathStep_m) path.push_back(line[i - 1] + (line[i] - line[i - 1]) * (at / length));
    rest = at - length;
  }
  return path;
}

/// Rounds the vertices with parabolas.
std::vector<Vector2> smooth_path(const StreetPlan& plan, const std::vector<Stretch>& stretches,
                                 const Vertices& vertices, double wish_m) {
  std::vector<Vector2> line{vertices.points.front()};
  for (std::size_t i = 1; i + 1 < vertices.points.size(); ++i) {
    const Vector2& at = vertices.points[i];
    const double bend = bend_length(plan, stretches, vertices, i, wish_m);
    const Vector2 from = at + bend * (vertices.points[i - 1] - at).normalized();
    const Vector2 to = at + bend * (vertices.points[i + 1] - at).normalized();
    for (int k = 0; k <= 16; ++k) {
      const double u = k / 16.0;
      line.push_back((1.0 - u) * (1.0 - u) * from + 2.0 * u * (1.0 - u) * at + u * u * to);
    }
  }
  line.push_back(vertices.points.back());
  return resample(line);
}

std::size_t steps(double length_m) {
  return static_cast<std::size_t>(length_m / kPathStep_m + 0.5);
}

void insert_gate(Route& route, const Gate& gate) {
  const auto later = std::ranges::find_if(route.gates, [&](const Gate& other) { return other.stop > gate.stop; });
  route.gates.insert(later, gate);
}

/// Distance before and behind a construction site at which people leave the sidewalk, and where the site begins.
constexpr double kDetourRamp_m = 3.0;
constexpr double kWorksBegin_m = 4.0;

/// The way round a construction site: on the roadway, beside the curb, as wide as the closed sidewalk.
void go_round_works(Route& route, const StreetPlan& plan, const SimulationConfig& config) {
  const Block& block = plan.blocks.front();
  const Vector2 along_curb = -left_of(block.inward_1);  // away from the corner
  Gate gate;
  for (std::size_t i = 0; i < route.path.size(); ++i) {
    Vector2& point = route.path[i];
    const double depth = (point - block.origin).dot(block.inward_1);
    const double along = (point - block.origin).dot(along_curb);
    if (depth < 0.0 || depth > plan.sidewalk_m) continue;
    const double outside = std::max(kWorksBegin_m - along, along - kWorksBegin_m - config.construction_length_m);
    const double share = std::clamp(1.0 - outside / kDetourRamp_m, 0.0, 1.0);
    const double shift = share * share * (3.0 - 2.0 * share) * (plan.sidewalk_m + 0.3);
    point -= shift * block.inward_1;
    if (shift <= depth) continue;
    if (!gate.roadway) gate.stop = gate.begin = i;
    gate.roadway = true;
    gate.end = i + 1;
  }
  if (gate.roadway) insert_gate(route, gate);
}

/// One gate for each crossing, in order, at the curb.
std::vector<Gate> find_gates(const StreetPlan& plan, const std::vector<Stretch>& stretches,
                             const std::vector<Vector2>& path, double stand_back_m) {
  std::vector<Gate> gates;
  std::size_t i = 0;
  for (const Stretch& stretch : stretches) {
    const Leg& leg = plan.legs[stretch.leg];
    if (!leg.crossed_arm) continue;
    const std::size_t arm = *leg.crossed_arm;
    while (i < path.size() && (block_of(plan, path[i]) || !between_curbs(plan, arm, path[i]))) ++i;
    Gate gate;
    gate.begin = i;
    while (i < path.size() && !block_of(plan, path[i])) ++i;
    gate.end = i;
    gate.stop = gate.begin - std::min(gate.begin, steps(stand_back_m));
    if (!gates.empty()) gate.stop = std::clamp(gate.stop, std::min(gates.back().end + 2, gate.begin), gate.begin);
    gate.leg = stretch.leg;
    gate.signal = gate.roadway = gate.marked = true;
    gates.push_back(gate);
  }
  return gates;
}

/// A walker stops in view on a sidewalk: looks at a phone, waits for a friend.
void add_standing(Route& route, const StreetPlan& plan, const SimulationConfig& config, Random& random) {
  const std::size_t at = static_cast<std::size_t>(random.uniform(0.25, 0.75) * static_cast<double>(route.path.size()));
  if ((route.path[at] - plan.blocks.front().origin).norm() > 0.9 * config.view_radius_m) return;
  const auto near = [&](const Gate& gate) { return at + 15 > gate.stop && at < gate.end + 10; };
  if (std::ranges::any_of(route.gates, near)) return;
  Gate gate;
  gate.stop = gate.begin = gate.end = at;
  gate.pause_s = random.uniform(4.0, 30.0);
  insert_gate(route, gate);
  route.traits.stands = true;
}

/// Turns round a corner: two sidewalks that are not parallel follow each other.
bool rounds_corner(const StreetPlan& plan, const std::vector<Stretch>& stretches) {
  for (std::size_t i = 1; i < stretches.size(); ++i) {
    const Leg& a = plan.legs[stretches[i - 1].leg];
    const Leg& b = plan.legs[stretches[i].leg];
    if (!a.crossed_arm && !b.crossed_arm && std::abs(cross(a.direction, b.direction)) > 1e-9) return true;
  }
  return false;
}

/// For each value what `reduce` makes of those within `reach` of it.
std::vector<double> around(const std::vector<double>& values, std::size_t reach, auto reduce) {
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t from = i > reach ? i - reach : 0, to = std::min(i + reach + 1, values.size());
    result.push_back(reduce(std::span(values).subspan(from, to - from)));
  }
  return result;
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

Route draw_route(const StreetPlan& plan, const SimulationConfig& config, Random& random) {
  Draft draft = draw_legs(plan, config, random);
  const bool jaywalker = random.chance(config.jaywalk_share);
  std::optional<std::size_t> unmarked;
  if (jaywalker && random.chance(0.7)) unmarked = leave_crosswalk(plan, draft, random);

  Route route;
  const Vertices vertices = to_vertices(plan, config, draft.stretches);
  route.path = smooth_path(plan, draft.stretches, vertices, random.uniform(1.2, 3.5));
  route.gates = find_gates(plan, draft.stretches, route.path, random.uniform(0.5, 1.3));
  for (Gate& gate : route.gates) {
    if (gate.leg != unmarked) continue;
    gate.signal = gate.marked = false;
    gate.pause_s = random.chance(0.5) ? 0.0 : random.uniform(0.5, 3.0);
  }
  route.traits.crossings = static_cast<int>(route.gates.size());
  route.traits.rounds_corner = rounds_corner(plan, draft.stretches);
  route.traits.ignores_red = jaywalker;
  route.traits.leaves_crosswalk = unmarked.has_value();
  if (config.construction_length_m > 0.0) go_round_works(route, plan, config);
  if (random.chance(config.stop_share)) add_standing(route, plan, config, random);
  return route;
}

Route beside(const Route& route, const StreetPlan& plan, double offset_m) {
  const std::vector<Vector2>& path = route.path;
  const auto moved = [&](std::size_t i, double share) {
    const Vector2 ahead = path[std::min(i + 1, path.size() - 1)] - path[i > 0 ? i - 1 : 0];
    return Vector2(path[i] + share * offset_m * left_of(ahead.normalized()));
  };
  // In bends, and where the strip is too narrow for two, the companion gradually moves behind the first.
  std::vector<double> room;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto block = block_of(plan, path[i]);
    const double depth = block ? depths(plan.blocks[*block], moved(i, 1.0)).minCoeff() : 0.5 * plan.sidewalk_m;
    const bool bend = i > 1 && i + 2 < path.size() &&
                      (path[i + 2] - path[i]).dot(path[i] - path[i - 2]) < 3.9 * kPathStep_m * kPathStep_m;
    room.push_back(!bend && depth > 0.35 && depth < plan.sidewalk_m - 0.4 ? 1.0 : 0.0);
  }
  constexpr std::size_t kReach = 8;
  Route companion = route;
  const std::vector<double> share = around(around(room, 2 * kReach, std::ranges::min), kReach, mean);
  for (std::size_t i = 0; i < path.size(); ++i) companion.path[i] = moved(i, share[i]);
  return companion;
}

}  // namespace sila::sim
