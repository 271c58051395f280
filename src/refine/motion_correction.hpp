#pragma once

#include <Eigen/Core>
#include <span>

#include "refine/fourier_features.hpp"

namespace sila {

/// What a correction by motion depends on [m/s], each in the heading frame: mean velocities of the last 0.4 and 1.6 s,
/// the predicted one to the horizon, and that of companions relative to the person's own.
struct MotionInput {
  Vector2 heading = Vector2::UnitX();          ///< world frame
  Eigen::Matrix<double, 4, 1> along, to_left;  ///< of the four velocities
};

/// `constant_mps`: of constant velocity, which is the heading. Velocities in the world frame.
MotionInput motion_input(const Vector2& constant_mps, const Vector2& last_0_4_s_mps, const Vector2& last_1_6_s_mps,
                         const Vector2& to_horizon_mps, const Vector2& companions_mps);

/// The error that stacking leaves, by how the person and companions walk, anywhere: ridge regression on random Fourier
/// features that are even (errors along the heading) or odd (errors to the left of it) under reflection, so that what
/// is learnt of a left turn holds for a right one. Sums of constant size that add exactly; the share of it that would
/// have been best so far is added. Source: none in the paper; docs/decisions/0124-companions.md.
class MotionCorrection {
 public:
  explicit MotionCorrection(const ErrorStatistics& error_statistics);

  /// Zero before anything was learnt.
  VelocityCorrection correction(const MotionInput& input, double horizon_s) const;
  /// Adds what a window shows. `errors_mps`: of stacked mean velocities from t0 to each step until the horizon.
  void add_window(ErrorStatistics& error_statistics, const MotionInput& input,
                  std::span<const Vector2> errors_mps) const;

 private:
  Eigen::Matrix<double, kCorrectionKnots, Eigen::Dynamic> along_, to_left_;  ///< empty before anything was learnt
  double share_ = 0.0;
};

}  // namespace sila
