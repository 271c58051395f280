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

std::vector<ExpertOpinion> ask_outlooks(const FieldMap& map, const CurbTrajectory& observed) {
  std::vector<ExpertOpinion> opinions;
  if (map.outlook_knots() == 0 || observed.positions.empty()) return opinions;
  const OutlookState state = outlook_state(observed);
  for (const int index : map.near(observed.positions.back())) {
    const std::optional<Posterior>& outlook = map.field(index).outlook;
    if (!outlook) continue;
    const GpPrediction said = outlook->predict(state);
    const double relative = std::max(1e-9, said.variance / outlook->signal_variance());
    const double gain = 1.0 / relative - 1.0;
    opinions.push_back(
        {index, gain, gain * outlook->noise_variance() / outlook->signal_variance(), said.mean / relative});
  }
  return opinions;
}

Foresight combine(const FieldMap& map, const CurbTrajectory& observed, std::span<const ExpertOpinion> opinions,
                  std::span<const int> excluded) {
  Foresight foresight;
  const int knots = map.outlook_knots();
  if (knots == 0) return foresight;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(2 * knots);
  double gain = 0.0;
  for (const ExpertOpinion& opinion : opinions) {
    if (std::find(excluded.begin(), excluded.end(), opinion.transition) != excluded.end()) continue;
    sum += opinion.weighted_mean;
    gain += opinion.gain;
    foresight.evidence += opinion.evidence;
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
