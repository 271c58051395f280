#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// A time-stamped path in the world frame, at most 1e6 s long.
/// Invariant: as many positions as times, at least one of each, times strictly increasing, none over 1e12.
struct Trajectory {
  std::string id;
  std::vector<double> times_s;
  std::vector<Vector2> positions_m;
  std::size_t recording = 0;  ///< which input it comes from; only tracks of one recording have a common clock
};

/// A path in the frame of a corner, with velocities, sampled at equal intervals. A type of its own, so that the two
/// frames cannot be mixed up. Invariant: as `Trajectory`; as many velocities as positions.
struct CurbTrajectory {
  std::string id;
  CurbFrame frame;                  ///< where it was seen; brings predictions back to metres
  std::vector<double> times_s;      ///< on the clock of the input
  std::vector<Vector2> positions;   ///< curb units
  std::vector<Vector2> velocities;  ///< curb units per second
  double still_s = 0.0;  ///< how long the whole track had stayed within 0.5 m of its last position; at most 60
};

/// Throws std::invalid_argument, naming the track and the sample, if the invariant does not hold.
void validate(const Trajectory& track);
void validate(const CurbTrajectory& track);

/// A track in the world frame and the corner by which it is looked at.
struct FramedTrajectory {
  Trajectory track;
  CurbFrame frame;
};

/// An observed path and what came after it.
struct Window {
  CurbTrajectory observed;
  std::vector<Vector2> past_m;    ///< the raw positions at the times of `observed`
  std::vector<Vector2> future_m;  ///< at the predictor's interval; may end before the horizon
};

}  // namespace sila
