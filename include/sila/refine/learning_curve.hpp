#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

namespace sila {

/// Sums over windows that reach the horizon, of people who move, predicted by a model that had not learnt their tracks.
struct PrequentialError {
  std::size_t windows = 0;
  double model_m = 0.0;     ///< mean displacement errors of the mean path [m]
  double constant_m = 0.0;  ///< the same of constant velocity

  /// Of the model, relative to constant velocity.
  double ratio() const { return model_m / constant_m; }

  PrequentialError& operator+=(const PrequentialError& more) {
    windows += more.windows;
    model_m += more.model_m;
    constant_m += more.constant_m;
    return *this;
  }
};

/// The prequential error of one batch, and the number of tracks that the model had learnt before it.
struct LearningPoint {
  double tracks = 0.0;
  PrequentialError error;
};

/// The error relative to constant velocity after n tracks: asymptote + slope / sqrt(n).
struct LearningCurve {
  Eigen::Vector2d coefficients;  ///< asymptote and slope
  Eigen::Matrix2d covariance;    ///< of the coefficients
  int points = 0;                ///< episodes that it is fitted to
};

/// A value and its 90 % confidence interval.
struct Estimate {
  double value = 0.0;
  double lower = 0.0;
  double upper = 0.0;
};

/// Fits the curve by least squares, weighted by windows; points without windows or without an error of constant
/// velocity do not count. Null for fewer than four points, or if all of them have the same number of tracks. Throws:
/// std::invalid_argument for a point with windows before the first track, or with errors that are negative or not
/// finite. Source: none in the paper; docs/decisions/0116-learning-curve.md.
std::optional<LearningCurve> fit_learning_curve(std::span<const LearningPoint> points);

/// The expected relative error after `tracks`. Throws: std::invalid_argument if tracks is not positive.
Estimate expected_error(const LearningCurve& curve, double tracks);

}  // namespace sila
