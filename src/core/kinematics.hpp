#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Constant velocity is the mean velocity over this last part of the observed window [s].
inline constexpr double kConstantVelocityWindow_s = 0.8;
/// Standard deviation of the error of constant velocity per second ahead, before any error is known [m/s].
inline constexpr double kConstantVelocitySpread_mps = 0.3;
/// A person stands as long as the distance from one position is at most this [m].
inline constexpr double kStandingReach_m = 0.5;

/// Mean velocities of the last 0.4, 0.8, 1.6 and 3 s, one a column [m/s].
using PastVelocities = Eigen::Matrix<double, 2, 4>;

/// Throws: std::invalid_argument, naming the function of the caller, if the track has no sample `last`.
void require_sample(const char* function, const Trajectory& track, std::size_t last);

/// The third component of the cross product: positive if `b` is left of `a`.
inline double cross(const Vector2& a, const Vector2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

inline double square(double x) {
  return x * x;
}

/// The direction of a vector; the first axis for one without length.
inline Vector2 unit_along(const Vector2& v) {
  const double length = v.norm();
  return length > 1e-9 ? Vector2(v / length) : Vector2(Vector2::UnitX());
}

/// The vector turned to the left by a right angle.
inline Vector2 left_of(const Vector2& direction) {
  return {-direction.y(), direction.x()};
}

/// Ahead and to the left, as columns.
inline Matrix2 axes_along(const Vector2& ahead) {
  Matrix2 axes;
  axes << ahead, left_of(ahead);
  return axes;
}

/// Mean velocity over the last `window_s` of the observed path, or over the whole path if it is shorter; of a single
/// sample its own velocity. Units: curb units/s. Throws: std::invalid_argument for an empty path.
Vector2 mean_velocity(const CurbTrajectory& observed, double window_s);

/// The same in the world frame [m/s].
Vector2 mean_velocity_mps(const CurbTrajectory& observed, double window_s);

/// The baseline: continues from the last position with the mean velocity of the last 0.8 s (less for a shorter path).
/// `past_m` is sampled every `interval_s`. Returns `steps` positions [m], `interval_s` apart.
/// Throws: std::invalid_argument for an empty path.
std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s);

/// Mean of the observed speeds [m/s]; 0 without samples.
double mean_speed_mps(const CurbTrajectory& observed);

}  // namespace sila
