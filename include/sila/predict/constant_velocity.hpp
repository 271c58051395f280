#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// The baseline: the last observed position goes on with the mean velocity of the last `window_s` of the observed path.
/// Returns `steps` positions [m] at steps of `interval_s`.
std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s,
                                       double window_s = 0.8);

/// Mean velocity over the last `window_s` (or over what there is) [m/s].
Vector2 mean_velocity_mps(const CurbTrajectory& observed, double window_s);

/// Mean of the observed speeds [m/s]; 0 for nobody.
double mean_speed_mps(const CurbTrajectory& observed);

}  // namespace sila
