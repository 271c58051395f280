#include <algorithm>
#include <cmath>

#include "walker.hpp"

namespace sila::sim {
namespace {

constexpr double kRelaxation_s = 0.5;    ///< relaxation to the desired velocity (about 0.5 s in social force models)
constexpr double kBraking_mps2 = 0.7;    ///< comfortable
constexpr double kStrongest_mps2 = 2.5;  ///< bound of all accelerations
constexpr double kLookAhead_m = 1.4;     ///< the point of the path steered at
constexpr double kAnticipation_s = 2.5;  ///< later encounters are ignored
constexpr double kSight_m = 6.0;
constexpr double kRoom_m = 0.9;  ///< distance that strangers leave when they pass
constexpr double kGroupRoom_m = 0.55;
constexpr double kShoulders_m = 0.45;  ///< closer than this two people push each other aside
constexpr double kWallRoom_m = 0.7;
constexpr double kWallClearance_m = 0.25;  ///< least distance of a walker's centre from a building
constexpr double kLongestHold_m = 0.1;
constexpr double kSlowest_mps = 0.15;  ///< slower is standing

/// The street of even arms has green from the start of the cycle, the other from its middle. No walker starts in the
/// last second.
bool walk_sign(const SimulationConfig& config, std::size_t arm, double time_s) {
  const double shifted = time_s + (arm % 2 == 0 ? 0.0 : 0.5 * config.signal_cycle_s);
  const double phase = shifted - config.signal_cycle_s * std::floor(shifted / config.signal_cycle_s);
  return phase < config.walk_phase_s - 1.0;
}

const Gate* gate_ahead(const Walker& walker) {
  return walker.gate < walker.route.gates.size() ? &walker.route.gates[walker.gate] : nullptr;
}

double distance_to_stop(const Walker& walker, const Gate& gate) {
  return (static_cast<double>(gate.stop) - static_cast<double>(walker.index)) * kPathStep_m;
}

/// The roadway that is being crossed.
const Gate* crossing(const Walker& walker) {
  const Gate* gate = gate_ahead(walker);
  return gate != nullptr && gate->roadway && walker.gate_open && walker.index >= gate->stop && walker.index <= gate->end
             ? gate
             : nullptr;
}

Vector2 path_heading(const Walker& walker, std::size_t ahead) {
  const std::size_t last = walker.route.path.size() - 1;
  const std::size_t i = std::min(walker.index + ahead, last - 1);
  return (walker.route.path[i + 1] - walker.route.path[i]).normalized();
}

/// The nearest path point near the last one; also behind it, as others may push a walker back.
void follow_path(Walker& walker) {
  constexpr std::size_t kWindow = 8;
  const std::vector<Vector2>& path = walker.route.path;
  const std::size_t from = walker.index > kWindow ? walker.index - kWindow : 0;
  const std::size_t end = std::min(walker.index + kWindow, path.size());
  double best = (path[walker.index] - walker.position).squaredNorm();
  for (std::size_t i = from; i < end; ++i) {
    const double distance = (path[i] - walker.position).squaredNorm();
    if (distance >= best) continue;
    best = distance;
    walker.index = i;
  }
}

/// Whether a gate is passed; a roadway only with both feet on the sidewalk.
bool behind(const Walker& walker, const Gate& gate, const StreetPlan& plan) {
  if (!gate.roadway) return walker.index >= gate.end;
  return walker.index > gate.end && block_of(plan, walker.position);
}

/// Decides whether the gate ahead may be passed; goes to the next gate once it lies behind.
void attend_gate(Walker& walker, const StreetPlan& plan, const SimulationConfig& config, double time_s, double step_s) {
  const Gate* gate = gate_ahead(walker);
  if (gate != nullptr && walker.gate_open && behind(walker, *gate, plan)) {
    ++walker.gate;
    walker.gate_open = false;
    walker.gate_waited_s = 0.0;
    gate = gate_ahead(walker);
  }
  if (gate == nullptr) return;
  const double distance = distance_to_stop(walker, *gate);
  const double speed = walker.velocity.norm();
  const bool walking = speed > 0.5 * walker.speed_mps;
  if (walker.gate_open && (!gate->signal || walking || walker.index + 2 >= gate->begin)) return;
  if (distance > 1.5) return;
  if (gate->signal) {
    // A walker who was still on the sidewalk when the signal changed waits again.
    if (!walk_sign(config, *plan.legs[gate->leg].crossed_arm, time_s)) {
      walker.gate_waited_s = 0.0;
      walker.gate_open = walker.route.traits.ignores_red;
      return;
    }
    walker.gate_waited_s += step_s;
    walker.gate_open = walking || walker.gate_waited_s > walker.reaction_s;
    return;
  }
  if (distance < 0.6 && speed < kSlowest_mps) walker.gate_waited_s += step_s;
  walker.gate_open = gate->pause_s <= 0.0 || walker.gate_waited_s > gate->pause_s;
}

/// The highest speed from which one stops comfortably within `distance_m`, minus the lag of the relaxation.
double stopping_speed(double distance_m, double speed_mps) {
  return std::sqrt(2.0 * kBraking_mps2 * std::max(0.0, distance_m - 0.5 * kRelaxation_s * speed_mps));
}

/// The gate ahead if it is closed for this walker.
const Gate* closed_gate(const Walker& walker, const StreetPlan& plan, const SimulationConfig& config, double time_s) {
  const Gate* gate = gate_ahead(walker);
  if (gate == nullptr || walker.gate_open) return nullptr;
  if (!gate->signal) return gate->pause_s > 0.0 ? gate : nullptr;
  if (walker.route.traits.ignores_red) return nullptr;
  const bool walking = walker.velocity.norm() > 0.5 * walker.speed_mps;
  return walking && walk_sign(config, *plan.legs[gate->leg].crossed_arm, time_s) ? nullptr : gate;
}

/// A pedestrian who waits behind another keeps a gap.
double queueing_speed(const Walker& walker, const std::vector<Walker>& walkers) {
  const Vector2 heading = path_heading(walker, 0);
  double speed = 10.0;
  for (const Walker& other : walkers) {
    const Vector2 to = other.position - walker.position;
    const double ahead = to.dot(heading);
    if (ahead <= 0.05 || ahead > 3.0 || std::abs(cross(heading, to)) > 0.4) continue;
    const double theirs = std::max(0.0, other.velocity.dot(heading));
    speed = std::min(speed, theirs + stopping_speed(ahead - 0.75, walker.velocity.norm()));
  }
  return speed;
}

double desired_speed(const Walker& walker, const std::vector<Walker>& walkers, const Gate* stop) {
  const double bend = std::max(0.0, path_heading(walker, 0).dot(path_heading(walker, 6)));
  double speed = walker.speed_mps * (1.0 + walker.pace) * (0.6 + 0.4 * bend);
  for (const Walker& other : walkers) {
    if (&other == &walker || other.party != walker.party) continue;
    const double ahead = (other.position - walker.position).dot(path_heading(walker, 0));
    speed += std::clamp(0.25 * ahead, -0.25, 0.25) * walker.speed_mps;
  }
  if (stop == nullptr) return std::max(speed, 0.0);
  const double distance = distance_to_stop(walker, *stop);
  if (distance > 6.0) return speed;
  const double at_gate = distance < 0.1 ? 0.0 : stopping_speed(distance, walker.velocity.norm());
  return std::min({speed, at_gate, queueing_speed(walker, walkers)});
}

/// Steps aside of where the other will be at the closest approach; to the right if both would meet head-on.
Vector2 avoid(const Walker& walker, const Walker& other) {
  const Vector2 apart = walker.position - other.position;
  const double distance2 = apart.squaredNorm();
  if (distance2 > kSight_m * kSight_m) return Vector2::Zero();
  const Vector2 closing = walker.velocity - other.velocity;
  const double closing2 = closing.squaredNorm();
  const double meet_s = closing2 > 1e-4 ? std::clamp(-apart.dot(closing) / closing2, 0.0, kAnticipation_s) : 0.0;
  const Vector2 miss = apart + meet_s * closing;
  const double room = other.party == walker.party ? kGroupRoom_m : kRoom_m;
  const double miss_m = miss.norm();
  Vector2 push = Vector2::Zero();
  const double speed = walker.velocity.norm();
  if (miss_m < room && speed > 1e-3) {
    const Vector2 heading = walker.velocity / speed;
    const Vector2 aside = miss - 0.2 * left_of(heading);
    push = (3.0 * (1.0 - miss_m / room) / (1.0 + meet_s)) * aside / (aside.norm() + 1e-6);
    push -= (0.6 * push.dot(heading)) * heading;  // people swerve rather than brake
  }
  const double distance = std::sqrt(distance2);
  if (distance < room) push += (2.0 * (1.0 - distance / room) / (distance + 1e-6)) * apart;
  return push;
}

/// The block of a point, or the nearest to a point on the roadway.
const Block& nearest_block(const StreetPlan& plan, const Vector2& point) {
  return *std::ranges::max_element(plan.blocks, {},
                                   [&](const Block& block) { return depths(block, point).minCoeff(); });
}

/// The push away from the building, and from the curb unless the walker crosses.
Vector2 keep_off_edges(const Walker& walker, const StreetPlan& plan) {
  const Block& block = nearest_block(plan, walker.position);
  const Vector2 depth = depths(block, walker.position);
  if (depth.minCoeff() < 0.0) return Vector2::Zero();
  const bool first = depth.x() <= depth.y();
  const Vector2& inward = first ? block.inward_1 : block.inward_2;
  const double curb_m = depth.minCoeff();
  const bool at_corner = !block.straight && depth.maxCoeff() < plan.sidewalk_m;
  const Vector2 from_wall =
      at_corner ? Vector2(walker.position - block.wall_corner) : Vector2((curb_m - plan.sidewalk_m) * inward);
  const double wall_m = from_wall.norm();
  Vector2 push = Vector2::Zero();
  if (wall_m < kWallRoom_m && wall_m > 1e-9) push = (4.0 * (1.0 - wall_m / kWallRoom_m) / wall_m) * from_wall;
  if (curb_m < 0.3 && crossing(walker) == nullptr) push += 3.0 * (1.0 - curb_m / 0.3) * inward;
  return push;
}

/// The point that the walker steers to: the furthest path point within kLookAhead_m that no building hides. In a narrow
/// bend it may be a point already passed.
Vector2 steering_point(const Walker& walker, const StreetPlan& plan) {
  const Vector2 aside = walker.wander_m * left_of(path_heading(walker, 0));
  const Block& block = nearest_block(plan, walker.position);
  const double wall_m = plan.sidewalk_m - kWallClearance_m - 0.05;
  const auto hidden = [&](const Vector2& target) {
    return depths(block, 0.5 * (walker.position + target)).minCoeff() > wall_m ||
           depths(block, 0.2 * walker.position + 0.8 * target).minCoeff() > wall_m;
  };
  const auto ahead = static_cast<std::size_t>(kLookAhead_m / kPathStep_m);
  const std::size_t furthest = std::min(walker.index + ahead, walker.route.path.size() - 1);
  for (std::size_t back = 0; back <= std::min(2 * ahead, furthest); ++back) {
    const Vector2 target = walker.route.path[furthest - back] + aside;
    if (!hidden(target)) return target;
  }
  return walker.route.path[furthest];
}

Vector2 acceleration(const Walker& walker, const std::vector<Walker>& walkers, const StreetPlan& plan,
                     const SimulationConfig& config, double time_s) {
  const Gate* stop = closed_gate(walker, plan, config, time_s);
  const Vector2 towards = steering_point(walker, plan) - walker.position;
  const double desired_mps = desired_speed(walker, walkers, stop);
  Vector2 sum = (desired_mps / (towards.norm() + 1e-6) * towards - walker.velocity) / kRelaxation_s;
  Vector2 push = keep_off_edges(walker, plan);
  for (const Walker& other : walkers)
    if (&other != &walker) push += avoid(walker, other);
  // A standing walker does not step aside.
  const bool standing = stop != nullptr && walker.velocity.norm() < kSlowest_mps && desired_mps < kSlowest_mps;
  sum += (standing ? 0.2 : 1.0) * push;
  const double size = sum.norm();
  return size > kStrongest_mps2 ? Vector2(sum * (kStrongest_mps2 / size)) : sum;
}

/// Moves a walker who is beyond a line back to it, at most by kLongestHold_m, and removes the velocity across the line.
void hold_behind(Walker& walker, const Vector2& normal, double excess_m) {
  if (excess_m <= 0.0) return;
  walker.position -= std::min(excess_m, kLongestHold_m) * normal;
  walker.velocity -= std::max(0.0, walker.velocity.dot(normal)) * normal;
}

/// The hard limits: no building; no roadway outside the crosswalk, unless the walker leaves crosswalks.
void stay_on_ground(Walker& walker, const StreetPlan& plan) {
  const Block& here = nearest_block(plan, walker.position);
  const Vector2 depth = depths(here, walker.position);
  if (depth.minCoeff() >= 0.0) {
    const double excess = depth.minCoeff() - (plan.sidewalk_m - kWallClearance_m);
    hold_behind(walker, depth.x() <= depth.y() ? here.inward_1 : here.inward_2, excess);
    return;
  }
  const Gate* gate = crossing(walker);
  if (gate == nullptr) {
    hold_behind(walker, -here.inward_1, 0.05 - depth.x());
    hold_behind(walker, -here.inward_2, 0.05 - depths(here, walker.position).y());
    return;
  }
  if (!gate->marked) return;
  const Leg& leg = plan.legs[gate->leg];
  const double across = (walker.position - leg.base).dot(leg.inward), slack = kCrosswalkMargin_m - 0.1;
  hold_behind(walker, leg.inward, across - plan.sidewalk_m - slack);
  hold_behind(walker, -leg.inward, -slack - across);
}

/// Pushes overlapping walkers apart.
void keep_apart(std::vector<Walker>& walkers) {
  for (std::size_t i = 0; i < walkers.size(); ++i) {
    for (std::size_t j = i + 1; j < walkers.size(); ++j) {
      const Vector2 apart = walkers[i].position - walkers[j].position;
      const double distance = apart.norm();
      if (distance >= kShoulders_m || distance < 1e-9) continue;
      const Vector2 push = (0.25 * (kShoulders_m - distance) / distance) * apart;
      walkers[i].position += push;
      walkers[j].position -= push;
    }
  }
}

/// Slow personal variation: an Ornstein-Uhlenbeck process of this spread and memory.
double drift(double value, double spread, double memory_s, double step_s, Random& random) {
  return value * (1.0 - step_s / memory_s) + spread * std::sqrt(2.0 * step_s / memory_s) * random.normal();
}

}  // namespace

bool finished(const Walker& walker) {
  return walker.index + 3 >= walker.route.path.size();
}

void step(std::vector<Walker>& walkers, const StreetPlan& plan, const SimulationConfig& config, double time_s,
          double step_s) {
  std::vector<Vector2> accelerations;
  accelerations.reserve(walkers.size());
  for (Walker& walker : walkers) attend_gate(walker, plan, config, time_s, step_s);
  for (const Walker& walker : walkers) accelerations.push_back(acceleration(walker, walkers, plan, config, time_s));
  for (std::size_t i = 0; i < walkers.size(); ++i) {
    Walker& walker = walkers[i];
    walker.velocity += step_s * accelerations[i];
    walker.position += step_s * walker.velocity;
    walker.pace = drift(walker.pace, 0.05, 5.0, step_s, walker.random);
    walker.wander_m = drift(walker.wander_m, 0.15, 4.0, step_s, walker.random);
  }
  keep_apart(walkers);
  for (Walker& walker : walkers) {
    stay_on_ground(walker, plan);
    follow_path(walker);
  }
}

}  // namespace sila::sim
