#pragma once

#include <Eigen/Core>
#include <span>

#include "refine/fourier_features.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

/// The position at t0, from the corner: along the first curb and to the left of it [m].
Vector2 position_at_corner_m(const CurbTrajectory& observed);

/// Predicts the error that stacking and the motion correction leave at a site, from the position and the predicted
/// position of a person: ridge regression on random Fourier features, whose moments have a constant size and add
/// exactly. A path gets it times the factor that would have been best so far (a step of boosting, Friedman 2001).
/// Source: none in the paper; docs/decisions/0123-path-correction.md.
class PathCorrection {
 public:
  explicit PathCorrection(const ErrorStatistics& error_statistics);

  /// Zero before anything was learnt.
  VelocityCorrection correction(const CurbTrajectory& observed, const Vector2& to_horizon_mps, double horizon_s) const;
  /// Adds a window. `errors_mps`: errors of mean velocities from t0 to each step until the horizon; `to_horizon_mps`:
  /// the predicted mean velocity until the horizon.
  void add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed,
                  std::span<const Vector2> errors_mps, const Vector2& to_horizon_mps) const;

 private:
  Eigen::Matrix<double, 2 * kCorrectionKnots, Eigen::Dynamic> coefficients_;  ///< empty before anything was learnt
  double share_ = 0.0;
};

}  // namespace sila
