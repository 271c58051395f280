#pragma once

#include <array>
#include <cstddef>
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

/// Covariance with the given variances along and across a direction.
Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2);

/// The density of prediction errors along and across the predicted way: a mixture of Gaussians, from narrow to wide,
/// whose variances are, at each step, those of the mixture times a scale that depends on the window. The scale is a
/// log-linear regression on squared errors (Harvey 1976); the mixture is fitted by online expectation maximisation
/// (Cappe and Moulines 2009), whose sums add exactly. Source: none in the paper; docs/decisions/0107-error-density.md.
class ErrorDensity {
 public:
  /// `state`: kWalking or kStanding, which have different priors.
  ErrorDensity(const DensityMoments& moments, int steps, double interval_s, std::size_t state = kWalking);

  /// Number of windows that it was fitted to.
  double windows() const { return windows_; }
  /// Factors of the nominal variances along and across.
  Vector2 scale(const ScaleFeatures& features) const;
  /// Share of each component, from 0 (narrow) to kMixtureComponents - 1 (wide).
  const std::array<double, kMixtureComponents>& weights() const { return weights_; }
  /// Variances [m^2] of a component along and across; beyond the fitted steps they grow with the square of time.
  Vector2 variances_m2(std::size_t component, std::size_t step, const Vector2& scale) const;
  /// Variances [m^2] of the whole mixture.
  Vector2 total_variances_m2(std::size_t step, const Vector2& scale) const;

  /// For an error (along, across) the probability that each component made it; the sum is 1.
  std::array<double, kMixtureComponents> responsibilities(std::size_t step, const Vector2& scale,
                                                          const Vector2& error_m) const;

 private:
  std::size_t steps_;
  double interval_s_;
  double windows_;
  Eigen::Matrix<double, kScaleFeatures, 2> coefficients_;
  std::array<double, kMixtureComponents> weights_ = {};
  std::vector<std::array<Vector2, kMixtureComponents>> relative_;  ///< variances relative to nominal ones, of each step
};

/// Adds the errors of one prediction to the moments. Shapes: one error (along, across) for each step that was seen, at
/// most as many as the moments have.
void add_errors(DensityMoments& moments, const ErrorDensity& density, const ScaleFeatures& features,
                const std::vector<Vector2>& errors_m, double interval_s);

}  // namespace sila
