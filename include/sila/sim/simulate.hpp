#pragma once

#include <cstddef>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/sim/config.hpp"
#include "sila/sim/scene.hpp"

namespace sila {

/// What a tracker cannot know of the walker behind a track.
struct WalkerTraits {
  std::size_t walker = 0;      ///< two tracks of one walker (an identity switch) share it
  double free_speed_mps = 0;   ///< personal desired speed
  int crossings = 0;           ///< streets crossed on the whole way, also outside the view
  bool rounds_corner = false;  ///< stays on the sidewalk of a corner and turns round it
  bool ignores_red = false;
  bool leaves_crosswalk = false;  ///< crosses a street away from the crosswalk
  bool stands = false;            ///< stops for a while on the sidewalk
  bool in_group = false;
};

/// `tracks[i]`, `truth[i]` and `traits[i]` belong together.
/// Invariant: ids unique, start times do not decrease, every stamp a multiple of the sample interval.
struct Simulation {
  IntersectionScene scene;
  std::vector<Trajectory> tracks;  ///< as a tracker reports them: noise, gaps, cuts
  std::vector<Trajectory> truth;   ///< same ids and ends, without noise and without gaps
  std::vector<WalkerTraits> traits;
};

/// Walks pedestrians through an intersection and tracks them. Pure: the same config gives the same bits with every
/// compiler and standard library (IEEE arithmetic without contraction or fast-math). Shapes: exactly `config.tracks`
/// tracks of at least 2 s. Units: seconds from the start of the simulation, metres in the world frame (origin in the
/// middle of the intersection). Throws: std::invalid_argument for an invalid config. Source: none; goal, route and
/// repulsion model of docs/decisions/0030.
Simulation simulate(const SimulationConfig& config);

}  // namespace sila
