#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// The shape of the simulated intersection; the angle is that of the primary corner between its two curbs.
enum class Layout {
  four_way,    ///< two streets, 90 degrees
  t_junction,  ///< a street that ends at another, 90 degrees; the third side is a straight sidewalk
  acute,       ///< two streets, 60 degrees
  obtuse,      ///< two streets, 120 degrees
};

inline constexpr std::array<const char*, 4> kLayoutNames{"four-way", "t-junction", "acute", "obtuse"};

/// Settings of `simulate`. Shares are of walkers unless the text says otherwise.
struct SimulationConfig {
  Layout layout = Layout::four_way;
  int tracks = 989;
  std::uint64_t seed = 1;
  double sample_interval_s = 0.1;
  double view_radius_m = 15.0;
  double sidewalk_width_m = 3.0;
  /// From curb to curb [m].
  static constexpr double road_width_m = 8.0;
  double construction_length_m = 0.0;

  /// Walkers or groups that enter the scene [1/s].
  static constexpr double arrivals_per_s = 0.25;
  /// How people walk; not settings, but tests vary them. Arrivals of two or three people who walk together; at a
  /// corner, those who stay on the sidewalk (the rest cross); those who ignore the red light or cross away from the
  /// crosswalk; those who stop for a while on the sidewalk.
  double group_share = 0.2, turn_share = 0.45, jaywalk_share = 0.08, stop_share = 0.05;
  /// Mean and spread of the personal free walking speeds [m/s].
  static constexpr double mean_speed_mps = 1.34, speed_std_mps = 0.26;
  /// Period of the pedestrian signals, and green for each street in it [s].
  static constexpr double signal_cycle_s = 40.0, walk_phase_s = 16.0;

  double noise_std_m = 0.03;
  double occlusions_per_min = 1.0;
  double cut_share = 0.12;
};

void fields(MaybeConst<SimulationConfig> auto& config, auto&& visit) {
  using R = Range;
  const R share{0.0, 1.0};
  visit.choice("layout", config.layout, kLayoutNames, "shape of the intersection");
  visit.number("tracks", config.tracks, R{1, 1e6}, "", "how many tracks the tracker reports");
  visit.number("seed", config.seed, R{0, 9007199254740992.0}, "", "the same seed gives the same bits");
  visit.number("sample_interval_s", config.sample_interval_s, R{0.01, 1.0}, "s", "time between two samples of a track");
  visit.number("view_radius_m", config.view_radius_m, R{8.0, 40.0}, "m",
               "the tracker sees this far round the primary corner");
  visit.number("sidewalk_width_m", config.sidewalk_width_m, R{2.0, 6.0}, "m", "from the curb to the building");
  visit.number(
      "construction_length_m", config.construction_length_m, R{0.0, 10.0}, "m",
      "closed part of the sidewalk along axis_1 of the primary corner, from 4 m off; people pass it on the roadway");
  visit.number("noise_std_m", config.noise_std_m, R{0.0, 0.5}, "m",
               "error of a reported position per axis, partly correlated in time");
  visit.number("occlusions_per_min", config.occlusions_per_min, R{0.0, 30.0}, "1/min",
               "gaps of 0.3 to 1.6 s in a track");
  visit.number("cut_share", config.cut_share, share, "",
               "share of walkers lost or found within the view, or given a second id");
}

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
