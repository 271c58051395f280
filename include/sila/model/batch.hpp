#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/residual.hpp"

namespace sila {

/// The tracks of one episode as they are learnt from. Invariant: `residuals` is empty, or has a list for each track.
struct Batch {
  std::vector<CurbTrajectory> tracks;  ///< curb coordinates, at the interval of the settings
  std::vector<std::vector<ResidualSample>> residuals;
};

}  // namespace sila
