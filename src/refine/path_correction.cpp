#include "refine/path_correction.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/kinematics.hpp"

namespace sila {
namespace {

/// Length scales of the kernel: of positions [m] and of velocities [m/s].
constexpr double kPlaceScale_m = 3.0, kVelocityScale_mps = 1.0;
constexpr double kCorrectionRidge = 1.0;
/// Windows after which half of the share that would have been best is added.
constexpr double kHalfWindows = 50.0;

/// What is learnt stands on a lattice of this many points a length scale: a sum over one window gives no coordinate
/// away.
constexpr double kLatticePoints = 6.0;

/// Position and predicted position at the horizon [m], and the predicted mean velocity until then [m/s], of a person at
/// a site: along the first curb and to the left of it, from the corner.
using CorrectionInput = Eigen::Matrix<double, 6, 1>;

CorrectionInput length_scales() {
  CorrectionInput scales;
  scales << kPlaceScale_m, kPlaceScale_m, kPlaceScale_m, kPlaceScale_m, kVelocityScale_mps, kVelocityScale_mps;
  return scales;
}

using Knots = Eigen::Matrix<double, 2 * kCorrectionKnots, 1>;
using FourierFeatures = Eigen::Matrix<double, kCorrectionFeatures, 1>;

/// Frequencies of a Gaussian kernel, and phases: the same numbers everywhere, as they are part of what is learnt.
struct FourierBasis {
  Eigen::Matrix<double, kCorrectionFeatures, 6> frequencies;
  FourierFeatures phases;

  FourierBasis() {
    std::mt19937_64 engine(1);
    const auto uniform = [&] { return (static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53; };
    for (double& frequency : frequencies.reshaped()) {  // Box and Muller
      const double radius = std::sqrt(-2.0 * std::log(uniform()));
      frequency = radius * std::cos(2.0 * std::numbers::pi * uniform());
    }
    for (double& phase : phases.reshaped()) phase = 2.0 * std::numbers::pi * uniform();
    frequencies.array().rowwise() /= length_scales().transpose().array();
  }
};

FourierFeatures fourier_features(const CorrectionInput& input) {
  static const FourierBasis basis;
  return std::sqrt(2.0 / kCorrectionFeatures) * (basis.frequencies * input + basis.phases).array().cos();
}

/// The first curb and the direction to the left of it, as columns.
Matrix2 axes_of(const CurbFrame& frame) {
  Matrix2 axes;
  axes << frame.axis_1, left_of(frame.axis_1);
  return axes;
}

CorrectionInput correction_input(const CurbTrajectory& observed, const Vector2& to_horizon_mps, double horizon_s) {
  const Matrix2 to_site = axes_of(observed.frame).transpose();
  const Vector2 position_m = to_world(observed.frame, observed.positions.back()) - observed.frame.origin_m;
  CorrectionInput input;
  input << to_site * position_m, to_site * (position_m + horizon_s * to_horizon_mps), to_site * to_horizon_mps;
  return input;
}

}  // namespace

PathCorrection::PathCorrection(const ErrorStatistics& error_statistics) {
  const auto& [weight, features, products] = error_statistics.correction;
  if (weight <= 0.0) return;
  Eigen::MatrixXd matrix = features;
  matrix.diagonal().array() += kCorrectionRidge;
  const Eigen::MatrixXd solved = matrix.llt().solve(products);
  if (!solved.allFinite()) return;
  coefficients_ = solved.transpose();
  const RegressionMoments& past = error_statistics.correction_share;
  if (past.features(0, 0) > 0.0)
    share_ =
        std::clamp(past.products(0, 0) / past.features(0, 0), 0.0, 1.0) * past.weight / (past.weight + kHalfWindows);
}

VelocityCorrection PathCorrection::correction(const CurbTrajectory& observed, const Vector2& to_horizon_mps,
                                              double horizon_s) const {
  VelocityCorrection correction{{}, horizon_s / kCorrectionKnots};
  correction.knots_mps.fill(Vector2::Zero());
  if (share_ == 0.0) return correction;
  const FourierFeatures features = fourier_features(correction_input(observed, to_horizon_mps, horizon_s));
  const Knots knots = coefficients_.lazyProduct(features);
  const Matrix2 axes = share_ * axes_of(observed.frame);
  for (int k = 0; k < kCorrectionKnots; ++k)
    correction.knots_mps[static_cast<std::size_t>(k)] = axes * knots.segment<2>(2 * k);
  return correction;
}

void PathCorrection::add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed,
                                std::span<const Vector2> truths_mps, std::span<const Vector2> stacked_mps) const {
  const std::size_t steps = truths_mps.size();
  const double horizon_s = static_cast<double>(steps) * error_statistics.interval_s;
  const Matrix2 to_site = axes_of(observed.frame).transpose();
  Knots left_mps;
  for (std::size_t k = 0; k < kCorrectionKnots; ++k) {
    const std::size_t step =
        ((k + 1) * steps + kCorrectionKnots - 1) / kCorrectionKnots - 1;  // the last one before the knot
    left_mps.segment<2>(2 * static_cast<Eigen::Index>(k)) = to_site * (truths_mps[step] - stacked_mps[step]);
  }
  const CorrectionInput step = length_scales() / kLatticePoints;
  const CorrectionInput input = correction_input(observed, stacked_mps.back(), horizon_s);
  const FourierFeatures features = fourier_features((input.array() / step.array()).round() * step.array());
  RegressionMoments& moments = error_statistics.correction;
  moments.weight += 1.0;
  moments.features.selfadjointView<Eigen::Lower>().rankUpdate(features);
  moments.products.noalias() += features * left_mps.transpose();
  if (coefficients_.size() == 0) return;
  const Knots known_mps = coefficients_ * features;
  error_statistics.correction_share.weight += 1.0;
  error_statistics.correction_share.features(0, 0) += known_mps.squaredNorm();
  error_statistics.correction_share.products(0, 0) += known_mps.dot(left_mps);
}

}  // namespace sila
