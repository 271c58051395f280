#include "refine/path_correction.hpp"

#include "core/kinematics.hpp"
#include "model/parts.hpp"

namespace sila {
namespace {

/// Length scales of the kernel: of positions [m] and of velocities [m/s].
constexpr double kPlaceScale_m = 3.0, kPlaceVelocityScale_mps = 1.0;
/// Features of the wide kernel, and their amplitude.
constexpr int kWidePlaceFeatures = kCorrectionFeatures / 3;
constexpr double kWidePlaceAmplitude = 3.0;

/// Learnt inputs are rounded to a lattice with this number of points per length scale, so that a sum over one window
/// reveals no coordinate.
constexpr double kLatticePoints = 6.0;

/// Position and predicted position at the horizon, and the predicted mean velocity until then, of a person at a site:
/// along the first curb and to the left of it, from the corner, in length scales.
using CorrectionInput = Eigen::Matrix<double, 6, 1>;

/// x and y at each knot.
using KnotVector = Eigen::Matrix<double, 2 * kCorrectionKnots, 1>;
using FourierFeatures = Eigen::Matrix<double, kCorrectionFeatures, 1>;

FourierFeatures fourier_features(const CorrectionInput& input) {
  static const FourierBasis<kCorrectionFeatures, 6> basis(kWidePlaceFeatures, kWidePlaceAmplitude);
  return basis.amplitudes.array() * (basis.frequencies * input + basis.phases).array().cos();
}

CorrectionInput correction_input(const CurbTrajectory& observed, const Vector2& to_horizon_mps, double horizon_s) {
  const Vector2 position_m = position_at_corner_m(observed);
  const Vector2 velocity_mps = axes_along(observed.frame.axis_1).transpose() * to_horizon_mps;
  CorrectionInput input;
  input << position_m / kPlaceScale_m, (position_m + horizon_s * velocity_mps) / kPlaceScale_m,
      velocity_mps / kPlaceVelocityScale_mps;
  return input;
}

}  // namespace

Vector2 position_at_corner_m(const CurbTrajectory& observed) {
  const CurbFrame& frame = observed.frame;
  return axes_along(frame.axis_1).transpose() * (to_world(frame, observed.positions.back()) - frame.origin_m);
}

PathCorrection::PathCorrection(const ErrorStatistics& error_statistics)
    : coefficients_(ridge_coefficients<2 * kCorrectionKnots>(error_statistics.correction)),
      share_(coefficients_.size() == 0 ? 0.0 : learnt_share(error_statistics.correction_share)) {}

VelocityCorrection PathCorrection::correction(const CurbTrajectory& observed, const Vector2& to_horizon_mps,
                                              double horizon_s) const {
  VelocityCorrection correction;
  correction.knot_interval_s = horizon_s / kCorrectionKnots;
  if (share_ == 0.0) return correction;
  const FourierFeatures features = fourier_features(correction_input(observed, to_horizon_mps, horizon_s));
  const KnotVector at_site_mps = coefficients_.lazyProduct(features);
  const Matrix2 axes = share_ * axes_along(observed.frame.axis_1);
  correction.knots_mps = axes * Knots::Map(at_site_mps.data());
  return correction;
}

void PathCorrection::add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed,
                                std::span<const Vector2> errors_mps, const Vector2& to_horizon_mps) const {
  const double horizon_s = static_cast<double>(errors_mps.size()) * error_statistics.interval_s;
  const Matrix2 to_site = axes_along(observed.frame.axis_1).transpose();
  const KnotErrors errors = knot_errors(errors_mps);
  const KnotVector errors_at_site_mps = (to_site * errors.at_mps).reshaped();
  const CorrectionInput input = correction_input(observed, to_horizon_mps, horizon_s);
  const FourierFeatures features = fourier_features((kLatticePoints * input).array().round() / kLatticePoints);
  add_examples(error_statistics.correction, features, errors_at_site_mps.transpose(), errors.weight);
  if (coefficients_.size() == 0) return;
  const KnotVector known_mps = coefficients_ * features;
  add_to_share(error_statistics.correction_share, known_mps.squaredNorm(), known_mps.dot(errors_at_site_mps),
               errors.weight);
}

}  // namespace sila
