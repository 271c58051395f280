#pragma once

#include <cstddef>
#include <vector>

#include "random.hpp"
#include "route.hpp"
#include "street_plan.hpp"

namespace sila::sim {

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

}  // namespace sila::sim
