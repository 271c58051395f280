#include "refine/motion_correction.hpp"

namespace sila {

MotionCorrection::MotionCorrection(const ErrorStatistics& error_statistics)
    : regression_(error_statistics.motion),
      share_(regression_.empty() ? 0.0 : learnt_share(error_statistics.motion_share)) {}

VelocityCorrection MotionCorrection::correction(const MotionInput& input, double horizon_s) const {
  if (share_ == 0.0) return {};
  VelocityCorrection correction = regression_.error(input, horizon_s);
  for (Vector2& knot_mps : correction.knots_mps) knot_mps *= share_;
  return correction;
}

void MotionCorrection::add_window(ErrorStatistics& error_statistics, const MotionInput& input,
                                  std::span<const Vector2> errors_mps) const {
  const KnotErrors errors = knot_errors(errors_mps);
  sila::add_window(error_statistics.motion, input, errors);
  if (regression_.empty()) return;
  const VelocityCorrection known = regression_.error(input, 1.0);
  double square = 0.0, product = 0.0;
  for (std::size_t k = 0; k < kCorrectionKnots; ++k) {
    square += known.knots_mps[k].squaredNorm();
    product += known.knots_mps[k].dot(errors.at_mps[k]);
  }
  add_to_share(error_statistics.motion_share, square, product, errors.weight);
}

}  // namespace sila
