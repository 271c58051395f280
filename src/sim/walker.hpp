#pragma once

#include <cstddef>
#include <vector>

#include "random.hpp"
#include "sila/sim/simulate.hpp"
#include "street_plan.hpp"

namespace sila::sim {

/// Distance between two points of a path [m].
inline constexpr double kPathStep_m = 0.2;

/// A place on a path where a walker may stop. Indices count path points.
struct Gate {
  std::size_t stop = 0;   ///< where to stand
  std::size_t begin = 0;  ///< first point on the roadway (as `stop` when there is no roadway)
  std::size_t end = 0;    ///< first point behind it
  std::size_t leg = 0;    ///< the crosswalk, in the plan
  bool signal = false;    ///< opens when the signal does, else after `pause_s`
  bool roadway = false;
  bool marked = false;  ///< the roadway is crossed on the crosswalk
  double pause_s = 0.0;
};

/// A whole way through the scene: a smooth line of points `kPathStep_m` apart, and the gates in order.
struct Route {
  std::vector<Vector2> path;
  std::vector<Gate> gates;
  WalkerTraits traits;
};

/// Draws a way from one end of a sidewalk to another, with the person's habits.
Route draw_route(const StreetPlan& plan, const SimulationConfig& config, Random& random);

/// The same way `offset_m` to its left, for the second of a group; gates keep their points.
Route beside(const Route& route, const StreetPlan& plan, double offset_m);

/// One walker and the state of the motion.
struct Walker {
  Walker(Route way, Random draws) : route(std::move(way)), random(draws) {}

  Route route;
  Random random;
  std::size_t party = 0;  ///< group: walkers who arrived together
  double speed_mps = 1.3;
  double reaction_s = 0.8;  ///< from green to the first step

  Vector2 position = Vector2::Zero();
  Vector2 velocity = Vector2::Zero();
  std::size_t index = 0;       ///< the path point passed last
  std::size_t gate = 0;        ///< the gate ahead or under way
  bool gate_open = false;      ///< decided to pass it
  double gate_waited_s = 0.0;  ///< green seen, or pause made, at this gate
  double pace = 0.0;           ///< slow variation of the speed, a share of it
  double wander_m = 0.0;       ///< slow variation of the lateral position

  std::size_t first_sample = 0;
  std::vector<Vector2> samples;  ///< true positions at the sampling instants since `first_sample`
};

bool finished(const Walker& walker);

/// Moves all walkers from `time_s` to `time_s + step_s`; all decisions use the positions at `time_s`.
void step(std::vector<Walker>& walkers, const StreetPlan& plan, const SimulationConfig& config, double time_s,
          double step_s);

/// One track as the tracker reports it, and its true samples: `seen` has indices of samples of the walker.
struct Sighting {
  std::size_t first = 0;  ///< true samples [first, last] of the walker
  std::size_t last = 0;
  std::vector<std::size_t> seen;
  std::vector<Vector2> measured_m;
};

/// The tracks that a tracker reports of one walker: the stay in view, perhaps cut or under two ids, with gaps and
/// noise.
std::vector<Sighting> track_walker(const std::vector<Vector2>& samples_m, const IntersectionScene& scene,
                                   const SimulationConfig& config, Random& random);

}  // namespace sila::sim
