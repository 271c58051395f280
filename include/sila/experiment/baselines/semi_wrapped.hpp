#pragma once

#include <span>
#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// One Gaussian over (direction, speed), wrapped round the circle in the first. Units: rad, m/s.
struct SemiWrappedGaussian {
  double weight = 0.0;
  Vector2 mean = Vector2::Zero();
  Matrix2 covariance = Matrix2::Identity();
};

/// An angle in [-pi, pi).
double wrapped_rad(double angle_rad);

/// Density of a mixture at (direction, speed) [1/(rad m/s)].
double density(std::span<const SemiWrappedGaussian> mixture, const Vector2& direction_speed);

/// A semi-wrapped Gaussian mixture of (direction, speed) samples: mean shift finds how many there are and where,
/// expectation maximisation their shapes. Nothing for nothing; weights sum to 1.
/// Source: Kucner et al., "Enabling Flow Awareness for Mobile Robots in Partially Observable Environments", RA-L 2017;
/// Roy, Parui, Roy, "SWGMM: a semi-wrapped Gaussian mixture model for clustering of circular-linear data", 2016.
/// Differs: fixed widths of the mean shift, which starts from at most 40 of the samples.
std::vector<SemiWrappedGaussian> fit_semi_wrapped(std::span<const Vector2> samples);

}  // namespace sila
