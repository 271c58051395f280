#pragma once

#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Growth of the error of constant velocity before any error is known [m/s].
inline constexpr double kConstantVelocitySpread_mps = 0.3;

/// The baseline: from the last position on with the mean velocity of the last 0.8 s of a path that was sampled by
/// `interval_s` (less where it is shorter). Returns `steps` positions [m] at steps of `interval_s`.
/// Throws: std::invalid_argument for an empty path.
std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s);

/// The same for an observed path as a predictor sees it, smoothed.
std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s);

}  // namespace sila
