#pragma once

#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Sidewalk width of a frame that is made from tracks [m].
inline constexpr double kTrackFrameWidth_m = 3.0;

/// The median along each axis. Precondition: not empty.
Vector2 median_position(const std::vector<Vector2>& positions);

/// The diagonal of the box around a track [m].
double extent_m(const Trajectory& track);

/// The frame of a place of which no corner is known: origin at the median position, rounded to whole metres so that it
/// is not the position of a person; axis_1 along the direction of the largest variance of the positions (its first
/// component that is not 0 is positive), axis_2 at a right angle, counter-clockwise; x and y where no direction stands
/// out. `from_tracks` is set. The present frames of the tracks are not used.
/// Shapes: at least one position in all tracks together. Units: metres, world frame.
/// Throws: std::invalid_argument without a position.
/// Source: none in the paper; docs/decisions/0110-frame-from-tracks.md.
CurbFrame frame_of_tracks(std::span<const FramedTrajectory> tracks);

}  // namespace sila
