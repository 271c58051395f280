#include "refine/motion_correction.hpp"

#include "core/kinematics.hpp"

namespace sila {
namespace {

/// Length scale of the kernel, of all velocities [m/s].
constexpr double kMotionScale_mps = 0.5;

using MotionFeatures = Eigen::Matrix<double, kMotionFeatures, 1>;
using Knots = Eigen::Matrix<double, kCorrectionKnots, 1>;

/// Sums and differences of the features of a motion and of its mirror image, scaled to length 1 on average:
/// cos(a + b) +- cos(a - b), where `a` has the components along the heading and `b` those to the left of it.
struct SymmetricFeatures {
  MotionFeatures even, odd;
};

SymmetricFeatures symmetric_features(const MotionInput& input) {
  static const FourierBasis<kMotionFeatures, 8> basis(Eigen::Matrix<double, 8, 1>::Constant(kMotionScale_mps));
  const MotionFeatures along = basis.frequencies.leftCols<4>().lazyProduct(input.along) + basis.phases;
  const MotionFeatures to_left = basis.frequencies.rightCols<4>().lazyProduct(input.to_left);
  const MotionFeatures own = (along + to_left).array().cos(), mirrored = (along - to_left).array().cos();
  const double scale = std::sqrt(1.0 / kMotionFeatures);
  return {scale * (own + mirrored), scale * (own - mirrored)};
}

}  // namespace

MotionInput motion_input(const Vector2& constant_mps, const Vector2& last_0_4_s_mps, const Vector2& last_1_6_s_mps,
                         const Vector2& to_horizon_mps, const Vector2& companions_mps) {
  MotionInput input;
  if (constant_mps.norm() > 1e-9) input.heading = constant_mps.normalized();
  Eigen::Matrix<double, 2, 4> velocities;
  velocities << last_0_4_s_mps, last_1_6_s_mps, to_horizon_mps, companions_mps;
  input.along = velocities.transpose() * input.heading;
  input.to_left = velocities.transpose() * left_of(input.heading);
  return input;
}

MotionCorrection::MotionCorrection(const ErrorStatistics& error_statistics)
    : along_(ridge_coefficients<kCorrectionKnots>(error_statistics.motion[0])),
      to_left_(ridge_coefficients<kCorrectionKnots>(error_statistics.motion[1])),
      share_(along_.size() == 0 || to_left_.size() == 0 ? 0.0 : learnt_share(error_statistics.motion_share)) {}

VelocityCorrection MotionCorrection::correction(const MotionInput& input, double horizon_s) const {
  VelocityCorrection correction;
  correction.knot_interval_s = horizon_s / kCorrectionKnots;
  if (share_ == 0.0) return correction;
  const SymmetricFeatures features = symmetric_features(input);
  const Knots along = along_.lazyProduct(features.even), to_left = to_left_.lazyProduct(features.odd);
  for (int k = 0; k < kCorrectionKnots; ++k)
    correction.knots_mps[static_cast<std::size_t>(k)] =
        share_ * (along(k) * input.heading + to_left(k) * left_of(input.heading));
  return correction;
}

void MotionCorrection::add_window(ErrorStatistics& error_statistics, const MotionInput& input,
                                  std::span<const Vector2> errors_mps) const {
  const KnotErrors errors = knot_errors(errors_mps);
  Knots along, to_left;
  for (int k = 0; k < kCorrectionKnots; ++k) {
    const Vector2& error = errors.at_mps[static_cast<std::size_t>(k)];
    along(k) = input.heading.dot(error), to_left(k) = cross(input.heading, error);
  }
  const SymmetricFeatures features = symmetric_features(input);
  add_weighted(error_statistics.motion[0], features.even, along, errors.weight);
  add_weighted(error_statistics.motion[1], features.odd, to_left, errors.weight);
  if (along_.size() == 0 || to_left_.size() == 0) return;
  const Knots known_along = along_ * features.even, known_to_left = to_left_ * features.odd;
  add_to_share(error_statistics.motion_share, known_along.squaredNorm() + known_to_left.squaredNorm(),
               known_along.dot(along) + known_to_left.dot(to_left), errors.weight);
}

}  // namespace sila
