#pragma once

#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Standard deviation of the error of constant velocity per second ahead, before any error is known [m/s].
inline constexpr double kConstantVelocitySpread_mps = 0.3;

/// The baseline: continues from the last position with the mean velocity of the last 0.8 s (less for a shorter path).
/// `past_m` is sampled every `interval_s`. Returns `steps` positions [m], `interval_s` apart.
/// Throws: std::invalid_argument for an empty path.
std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s);

}  // namespace sila
