#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sila/core/curb_frame.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/sim/config.hpp"

namespace sila {

/// Corners of a closed area in counter-clockwise order, the last joins the first [m].
using Polygon = std::vector<Vector2>;

/// A street corner: the block lies in the wedge from axis_1 counter-clockwise to axis_2, the roadway outside.
struct NamedCorner {
  std::string name;
  CurbFrame frame;
};

/// The geometry of a simulated place; y points up, lengths are metres in the world frame.
struct IntersectionScene {
  std::string name;                  ///< as the layout
  std::vector<NamedCorner> corners;  ///< first the primary one
  double sidewalk_width_m = 0.0;     ///< perpendicular to the curb, the same for all sidewalks
  double view_radius_m = 0.0;        ///< the tracker sees this far round the primary corner
  std::vector<Polygon> sidewalks;    ///< to draw; the curb is rounded here, the frames use the straight curbs
  std::vector<Polygon> crosswalks;
  std::vector<Polygon> buildings;
};

/// The corner that the tracks are about.
inline const NamedCorner& primary_corner(const IntersectionScene& scene) {
  return scene.corners.front();
}

/// The geometry alone: the same for every seed.
/// Throws: std::invalid_argument for an invalid config.
IntersectionScene simulated_scene(const SimulationConfig& config);

/// Whether a point lies inside (even-odd rule; the border may fall on either side).
bool contains(const Polygon& polygon, const Vector2& point);

/// Properties of the walker of a track that a tracker does not observe.
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
