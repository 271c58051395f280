#pragma once

#include <span>

#include "refine/motion_regression.hpp"

namespace sila {

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
