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

}  // namespace sila::sim
