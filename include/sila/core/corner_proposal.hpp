#pragma once

#include <cstddef>
#include <span>

#include "sila/core/trajectory.hpp"

namespace sila {

/// A corner proposed from where people walk, with the standard errors of ten parts of the tracks (jackknife).
struct CornerProposal {
  CurbFrame frame;
  SidewalkWidths widths;
  double origin_error_m = 0.0;  ///< of the origin; large if the parts disagree about the corner
  double axis_error_rad = 0.0;  ///< of the direction of either axis, the larger one
  double share_1 = 0.0;         ///< of the distance walked, within 15 degrees of axis_1; likewise share_2
  double share_2 = 0.0;
  std::size_t turning_tracks = 0;  ///< that turn from one axis into the other at this corner
};

/// The corner at which most tracks turn between the two main directions of walking: the directions are the two highest
/// peaks of the distribution of headings modulo 180 degrees, at least 25 degrees apart; along each, the strips in
/// which people walk are the peaks of the distribution of lateral positions. The corner of the strips away from the
/// block, which is where the turning tracks pass, is the origin. Widths are those of the strips that people use, which
/// is less than from curb to wall.
/// Shapes: at least 10 tracks that move 3 m. Units: metres, world frame.
/// Throws: std::invalid_argument for fewer tracks, and without a second direction in which a twentieth of the distance
/// is walked. Source: none; docs/decisions/0114-corner-from-tracks.md.
CornerProposal propose_corner(std::span<const Trajectory> tracks, CurbScaling scaling);

}  // namespace sila
