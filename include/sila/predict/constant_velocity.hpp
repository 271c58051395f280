#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/outlook.hpp"

namespace sila {

/// The baseline: the last observed position goes on with the mean velocity of the last `window_s` of the observed path.
/// Returns `steps` positions [m] at steps of `interval_s`.
std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s,
                                       double window_s = kConstantVelocityWindow_s);

}  // namespace sila
