#include "refine/motion_correction.hpp"

#include "model/parts.hpp"

namespace sila {
namespace {

/// Length scales of the kernel: of velocities, of changes of the past velocity, and of the predicted change [m/s].
constexpr double kVelocityScale_mps = 0.8, kPastChangeScale_mps = 0.2, kPredictedChangeScale_mps = 0.4;
/// Features of the wide kernel, and their amplitude: as good as a regression on squares and products of velocities.
constexpr int kWideMotionFeatures = kMotionFeatures / 2;
constexpr double kWideMotionAmplitude = 10.0;

using MotionFeatures = Eigen::Matrix<double, kMotionFeatures, 1>;
using KnotValues = Eigen::Matrix<double, kCorrectionKnots, 1>;

using Velocities = Eigen::Matrix<double, 2, kMotionVelocities>;

/// Sums and differences of the features of a motion and of its mirror image, divided by sqrt(2): cos(a + b) +-
/// cos(a - b), where `a` has the components along the heading and `b` those to the left of it.
struct SymmetricFeatures {
  MotionFeatures even, odd;
};

SymmetricFeatures symmetric_features(const MotionInput& input) {
  constexpr int inputs = kMotionVelocities;
  static const FourierBasis<kMotionFeatures, 2 * inputs> basis(kWideMotionFeatures, kWideMotionAmplitude);
  const MotionFeatures along = basis.frequencies.leftCols<inputs>().lazyProduct(input.along) + basis.phases;
  const MotionFeatures to_left = basis.frequencies.rightCols<inputs>().lazyProduct(input.to_left);
  const MotionFeatures own = (along + to_left).array().cos(), mirrored = (along - to_left).array().cos();
  const MotionFeatures scale = std::sqrt(0.5) * basis.amplitudes;
  return {scale.cwiseProduct(own + mirrored), scale.cwiseProduct(own - mirrored)};
}

/// `scaled`: in the world frame, divided by the length scales.
MotionInput in_heading_frame(const Vector2& velocity_mps, const Velocities& scaled) {
  MotionInput input;
  if (velocity_mps.norm() > 1e-9) input.heading = velocity_mps.normalized();
  input.along = scaled.transpose() * input.heading;
  input.to_left = scaled.transpose() * left_of(input.heading);
  return input;
}

}  // namespace

MotionInput motion_input(const PastVelocities& past_mps, const Vector2& companions_mps) {
  Velocities velocities_mps;
  velocities_mps << past_mps, Vector2::Zero(), companions_mps;
  return in_heading_frame(past_mps.col(1), velocities_mps / kVelocityScale_mps);
}

MotionInput change_input(const PastVelocities& past_mps, const Vector2& to_horizon_mps, const Vector2& companions_mps) {
  const Vector2 constant_mps = past_mps.col(1);
  Velocities scaled;
  scaled << constant_mps / kVelocityScale_mps,
      (past_mps.leftCols<3>() - past_mps.rightCols<3>()) / kPastChangeScale_mps,
      (to_horizon_mps - constant_mps) / kPredictedChangeScale_mps, companions_mps / kVelocityScale_mps;
  return in_heading_frame(constant_mps, scaled);
}

MotionRegression::MotionRegression(const MotionMoments& moments)
    : along_(ridge_coefficients<kCorrectionKnots>(moments[0])),
      to_left_(ridge_coefficients<kCorrectionKnots>(moments[1])) {}

VelocityCorrection MotionRegression::error(const MotionInput& input, double horizon_s) const {
  VelocityCorrection found;
  found.knot_interval_s = horizon_s / kCorrectionKnots;
  if (empty()) return found;
  const SymmetricFeatures features = symmetric_features(input);
  const KnotValues along = along_.lazyProduct(features.even), to_left = to_left_.lazyProduct(features.odd);
  found.knots_mps = input.heading * along.transpose() + left_of(input.heading) * to_left.transpose();
  return found;
}

void add_window(MotionMoments& moments, const MotionInput& input, const KnotErrors& errors) {
  const SymmetricFeatures features = symmetric_features(input);
  add_examples(moments[0], features.even, input.heading.transpose() * errors.at_mps, errors.weight);
  add_examples(moments[1], features.odd, left_of(input.heading).transpose() * errors.at_mps, errors.weight);
}

MotionCorrection::MotionCorrection(const ErrorStatistics& error_statistics)
    : regression_(error_statistics.motion),
      share_(regression_.empty() ? 0.0 : learnt_share(error_statistics.motion_share)) {}

VelocityCorrection MotionCorrection::correction(const MotionInput& input, double horizon_s) const {
  if (share_ == 0.0) return {};
  VelocityCorrection correction = regression_.error(input, horizon_s);
  correction.knots_mps *= share_;
  return correction;
}

void MotionCorrection::add_window(ErrorStatistics& error_statistics, const MotionInput& input,
                                  std::span<const Vector2> errors_mps) const {
  const KnotErrors errors = knot_errors(errors_mps);
  sila::add_window(error_statistics.motion, input, errors);
  if (regression_.empty()) return;
  const VelocityCorrection known = regression_.error(input, 1.0);
  double square = 0.0, product = 0.0;
  for (Eigen::Index k = 0; k < kCorrectionKnots; ++k) {
    square += known.knots_mps.col(k).squaredNorm();
    product += known.knots_mps.col(k).dot(errors.at_mps.col(k));
  }
  add_to_share(error_statistics.motion_share, square, product, errors.weight);
}

}  // namespace sila
