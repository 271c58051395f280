#include "sila/predict/outlooks.hpp"

#include <algorithm>
#include <cmath>

#include "sila/model/gait.hpp"
#include "sila/model/outlook.hpp"

namespace sila {

Vector2 Foresight::parting_mps(double seconds) const {
  if (partings_mps.empty()) return Vector2::Zero();
  const double place = std::clamp(seconds / knot_interval_s - 1.0, 0.0, static_cast<double>(partings_mps.size() - 1));
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, partings_mps.size() - 1);
  const double share = place - std::floor(place);
  return (1.0 - share) * partings_mps[before] + share * partings_mps[after];
}

Foresight consult_outlooks(const FieldMap& map, const CurbTrajectory& observed) {
  Foresight foresight;
  const int knots = map.outlook_knots();
  if (knots == 0 || observed.positions.empty()) return foresight;
  const OutlookState state = outlook_state(observed);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(2 * knots);  // of means, each times its precision
  double gain = 0.0;                                       // of precision, relative to the prior's
  for (const int index : map.near(observed.positions.back())) {
    const FieldMap::Field& field = map.field(index);
    if (!field.outlook) continue;
    const GpPrediction said = field.outlook->predict(state);
    const double relative = std::max(1e-9, said.variance / field.outlook->signal_variance());
    sum += said.mean / relative;
    gain += 1.0 / relative - 1.0;
    foresight.evidence += (1.0 / relative - 1.0) * field.outlook->noise_variance() / field.outlook->signal_variance();
  }
  sum /= 1.0 + gain;
  foresight.knot_interval_s = map.outlook_horizon_s() / knots;
  for (int knot = 0; knot < knots; ++knot)
    foresight.partings_mps.push_back(velocity_to_world(observed.frame, sum.segment<2>(2 * knot)));
  return foresight;
}

Foresight consult_gait(const FieldMap& map, const CurbTrajectory& observed) {
  Foresight foresight;
  const int knots = map.outlook_knots();
  if (!map.gait() || observed.positions.empty()) return foresight;
  const GpPrediction said = map.gait()->predict(gait_state(observed));
  const Matrix2 frame = gait_frame(observed);
  foresight.knot_interval_s = map.outlook_horizon_s() / knots;
  for (int knot = 0; knot < knots; ++knot) foresight.partings_mps.emplace_back(frame * said.mean.segment<2>(2 * knot));
  return foresight;
}

}  // namespace sila
