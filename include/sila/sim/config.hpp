#pragma once

#include <array>
#include <cstdint>

#include "sila/core/fields.hpp"

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
  /// How people walk; no settings, but tests vary them. Arrivals of two or three people who walk together; at a corner,
  /// those who stay on the sidewalk (the rest cross); those who ignore the red light or cross away from the crosswalk;
  /// those who stop for a while on the sidewalk.
  double group_share = 0.2, turn_share = 0.45, jaywalk_share = 0.08, stop_share = 0.05;
  /// Mean and spread of the personal free walking speeds [m/s].
  static constexpr double mean_speed_mps = 1.34, speed_std_mps = 0.26;
  /// Period of the pedestrian signals, and green for each street in it [s].
  static constexpr double signal_cycle_s = 40.0, walk_phase_s = 16.0;

  double noise_std_m = 0.03;
  double occlusions_per_min = 1.0;
  double cut_share = 0.12;
};

template <class Config, class Visitor>
void fields(Config& config, Visitor&& visit) {
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
  visit.number("cut_share", config.cut_share, share, "", "walkers lost or found in mid view, or given a second id");
}

/// Throws: std::invalid_argument for a field out of its range.
void validate(const SimulationConfig& config);

}  // namespace sila
