#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/outlook.hpp"

namespace sila {

/// The tracks of one episode as they are learnt from. Invariant: `outlooks` is empty, or has a list for each track.
struct Batch {
  std::vector<CurbTrajectory> tracks;  ///< curb coordinates, at the conventions' interval
  std::vector<std::vector<OutlookExample>> outlooks;
};

}  // namespace sila
