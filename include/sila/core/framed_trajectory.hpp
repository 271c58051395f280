#pragma once

#include "sila/core/trajectory.hpp"

namespace sila {

/// A track in the world frame and the corner by which it is looked at.
struct FramedTrajectory {
  Trajectory track;
  CurbFrame frame;
};

}  // namespace sila
