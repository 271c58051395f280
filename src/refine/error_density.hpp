#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/kinematics.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

using ScaleFeatures = Eigen::Matrix<double, kScaleFeatures, 1>;

/// Lower bound of errors: equal paths of all pedestrians would otherwise make the covariances zero.
inline constexpr double kLeastError_m = 1e-3;

/// The features of the scale of errors of one prediction.
/// Units: past velocities, the predicted mean velocity until the horizon [m/s], and the effective number of samples of
/// the residual GPs.
ScaleFeatures scale_features(const PastVelocities& past_mps, const Vector2& predicted_mps, double local_support);

/// From narrow to wide; the sum is 1.
using ComponentWeights = std::array<double, kMixtureComponents>;

/// The density of the errors of one window, relative to that of all windows.
struct ErrorScale {
  Vector2 factors = Vector2::Ones();  ///< of the variances along and across
  ComponentWeights weights = {};
};

/// Covariance with the given variances along and across a direction.
Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2);

/// The density of prediction errors along and across the predicted way: a mixture of Gaussians, from narrow to wide,
/// whose variances and weights depend on the window. The variances are, at each step, those of the mixture times a
/// scale, a log-linear regression on squared errors (Harvey 1976). For people faster than those learnt, the scale
/// grows with a power of the speed. The weights are a regression on the probabilities that each component made the
/// errors (a mixture of experts, Jordan and Jacobs 1994). The mixture is fitted by online expectation maximisation
/// (Cappe and Moulines 2009), whose sums add exactly. Source: none in the paper; docs/decisions/0107-error-density.md
/// and 0138-faster-people.md.
class ErrorDensity {
 public:
  /// `state`: kWalking or kStanding, which have different priors.
  ErrorDensity(const DensityMoments& moments, int steps, double interval_s, std::size_t state = kWalking);

  /// Number of windows that it was fitted to.
  double windows() const { return windows_; }
  ErrorScale scale(const ScaleFeatures& features) const;
  /// Variances [m^2] of a component along and across; beyond the fitted steps they grow with the square of time.
  Vector2 variances_m2(std::size_t component, std::size_t step, const ErrorScale& scale) const;
  /// Variances [m^2] of the whole mixture.
  Vector2 total_variances_m2(std::size_t step, const ErrorScale& scale) const;

  /// For an error (along, across) the probability that each component made it; the sum is 1.
  ComponentWeights responsibilities(std::size_t step, const ErrorScale& scale, const Vector2& error_m) const;

  /// Adds the errors of one prediction to the moments. Shapes: one error (along, across) for each step that was seen,
  /// at most as many as the moments have.
  void add_errors(DensityMoments& moments, const ScaleFeatures& features, const std::vector<Vector2>& errors_m) const;

 private:
  double interval_s_;
  double windows_;
  Eigen::Matrix<double, kScaleFeatures, kScaleOutputs> coefficients_;
  ScaleFeatures mean_ = ScaleFeatures::Zero();
  double fastest_ = std::numeric_limits<double>::infinity();  ///< limit of the features of speed in the regressions
  ComponentWeights weights_ = {};
  std::vector<std::array<Vector2, kMixtureComponents>> relative_;  ///< variances relative to nominal ones, of each step
};

}  // namespace sila
