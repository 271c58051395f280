#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "refine/residuals.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

/// What to add to the mean velocity from t0 to each of some times ahead [m/s], in the world frame.
struct VelocityCorrection {
  std::array<Vector2, kCorrectionKnots> knots_mps;
  double knot_interval_s = 1.0;

  Vector2 at(double seconds) const { return ResidualPrediction{knots_mps, knot_interval_s}.residual_mps(seconds); }
};

/// The error that stacking leaves at a site, by where a person is and is predicted to go: ridge regression on random
/// Fourier features (Rahimi and Recht 2007), from sums of constant size that add exactly. The share of it that would
/// have been best so far is added to a path: a step of boosting (Friedman 2001), stacked by its prequential errors.
/// Source: none in the paper; docs/decisions/0123-path-correction.md.
class PathCorrection {
 public:
  explicit PathCorrection(const ErrorStatistics& error_statistics);

  /// Zero before anything was learnt.
  VelocityCorrection correction(const CurbTrajectory& observed, const Vector2& to_horizon_mps, double horizon_s) const;
  /// Adds what a window shows. `truths_mps`, `stacked_mps`: mean velocities from t0 to each step until the horizon.
  void add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed,
                  std::span<const Vector2> truths_mps, std::span<const Vector2> stacked_mps) const;

 private:
  Eigen::Matrix<double, 2 * kCorrectionKnots, Eigen::Dynamic> coefficients_;  ///< empty before anything was learnt
  double share_ = 0.0;
};

}  // namespace sila
