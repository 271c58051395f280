#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sila/core/curb_frame.hpp"
#include "sila/sim/config.hpp"

namespace sila {

/// Corners of a closed area in counter-clockwise order, the last joins the first [m].
using Polygon = std::vector<Vector2>;

/// A street corner: the block lies in the wedge from axis_1 counter-clockwise to axis_2, the roadway outside.
struct NamedCorner {
  std::string name;
  CurbFrame frame;
};

/// What is known of a simulated place; y points up, lengths are metres in the world frame.
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

}  // namespace sila
