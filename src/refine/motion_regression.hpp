#pragma once

#include <Eigen/Core>

#include "refine/fourier_features.hpp"

namespace sila {

/// How a person walks, in the heading frame [m/s]: mean velocities of the last 0.4, 0.8, 1.6 and 3 s, the predicted one
/// until the horizon, and that of companions relative to the person's own.
inline constexpr int kMotionVelocities = 6;
struct MotionInput {
  Vector2 heading = Vector2::UnitX();                          ///< world frame
  Eigen::Matrix<double, kMotionVelocities, 1> along, to_left;  ///< of each velocity
};

/// `past_mps`: of the last 0.4, 0.8, 1.6 and 3 s; the second is the heading. In the world frame.
MotionInput motion_input(const Eigen::Matrix<double, 2, 4>& past_mps, const Vector2& to_horizon_mps,
                         const Vector2& companions_mps);

/// Errors of mean velocities by how people walk, anywhere: ridge regression on random Fourier features that are even
/// (errors along the heading) or odd (errors to the left of it) under reflection, so that what is learnt of a left turn
/// holds for a right one. Sums of constant size that add exactly.
/// Source: none in the paper; Rahimi and Recht 2007; docs/decisions/0124-companions.md.
class MotionRegression {
 public:
  explicit MotionRegression(const MotionMoments& moments);

  bool empty() const { return along_.size() == 0 || to_left_.size() == 0; }
  /// Zero before anything was learnt.
  VelocityCorrection error(const MotionInput& input, double horizon_s) const;

 private:
  Eigen::Matrix<double, kCorrectionKnots, Eigen::Dynamic> along_, to_left_;  ///< empty before anything was learnt
};

/// Adds a window.
void add_window(MotionMoments& moments, const MotionInput& input, const KnotErrors& errors);

}  // namespace sila
