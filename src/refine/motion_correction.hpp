#pragma once

#include <Eigen/Core>
#include <span>

#include "core/kinematics.hpp"
#include "refine/fourier_features.hpp"

namespace sila {

/// Number of velocities of a MotionInput.
inline constexpr int kMotionVelocities = 6;
/// The motion of a person, in the heading frame: velocities divided by the length scales of the kernel.
struct MotionInput {
  Vector2 heading = Vector2::UnitX();                          ///< world frame
  Eigen::Matrix<double, kMotionVelocities, 1> along, to_left;  ///< of each velocity
};

/// The input for errors of constant velocity. `past_mps`: means of the last 0.4, 0.8, 1.6 and 3 s; the second gives the
/// heading. `companions_mps`: mean velocity of companions relative to the person's own. All in the world frame.
MotionInput motion_input(const PastVelocities& past_mps, const Vector2& companions_mps);

/// The input for errors of stacked velocities: the velocity of the last 0.8 s, the differences between successive past
/// means, and the difference between the predicted mean velocity until the horizon and that of the last 0.8 s.
/// `past_mps`, `companions_mps`: as above.
MotionInput change_input(const PastVelocities& past_mps, const Vector2& to_horizon_mps, const Vector2& companions_mps);

/// Predicts errors of mean velocities from the motion of a person, independent of the place: ridge regression on random
/// Fourier features that are even (errors along the heading) or odd (errors to the left of it) under reflection, so
/// that left and right turns are learnt together. Its moments have a constant size and add exactly. Source: none in the
/// paper; Rahimi and Recht 2007; docs/decisions/0124-companions.md.
class MotionRegression {
 public:
  explicit MotionRegression(const MotionMoments& moments);

  bool empty() const { return along_.size() == 0 || to_left_.size() == 0; }
  /// Zero before anything was learnt.
  VelocityCorrection error(const MotionInput& input, double horizon_s) const;

 private:
  Eigen::Matrix<double, kCorrectionKnots, Eigen::Dynamic> along_, to_left_;  ///< empty before anything was learnt
};

void add_window(MotionMoments& moments, const MotionInput& input, const KnotErrors& errors);

/// Predicts the error that stacking leaves from the motion of a person and of companions, independent of the place: a
/// motion regression, times the factor that would have been best so far.
/// Source: none in the paper; docs/decisions/0124-companions.md.
class MotionCorrection {
 public:
  explicit MotionCorrection(const ErrorStatistics& error_statistics);

  /// Zero before anything was learnt.
  VelocityCorrection correction(const MotionInput& input, double horizon_s) const;
  /// Adds a window. `errors_mps`: of stacked mean velocities from t0 to each step until the horizon.
  void add_window(ErrorStatistics& error_statistics, const MotionInput& input,
                  std::span<const Vector2> errors_mps) const;

 private:
  MotionRegression regression_;
  double share_ = 0.0;
};

}  // namespace sila
