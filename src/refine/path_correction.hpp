#pragma once

#include <Eigen/Core>
#include <span>

#include "refine/fourier_features.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

/// The error that stacking and the correction by motion leave at a site, by where a person is and is predicted to go:
/// ridge regression on random Fourier features, from sums of constant size that add exactly. The share of it that would
/// have been best so far is added to a path: a step of boosting (Friedman 2001), stacked by its prequential errors.
/// Source: none in the paper; docs/decisions/0123-path-correction.md.
class PathCorrection {
 public:
  explicit PathCorrection(const ErrorStatistics& error_statistics);

  /// Zero before anything was learnt.
  VelocityCorrection correction(const CurbTrajectory& observed, const Vector2& to_horizon_mps, double horizon_s) const;
  /// Adds what a window shows. `errors_mps`: of mean velocities from t0 to each step until the horizon, the last of
  /// which was predicted as `to_horizon_mps`.
  void add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed,
                  std::span<const Vector2> errors_mps, const Vector2& to_horizon_mps) const;

 private:
  Eigen::Matrix<double, 2 * kCorrectionKnots, Eigen::Dynamic> coefficients_;  ///< empty before anything was learnt
  double share_ = 0.0;
};

}  // namespace sila
