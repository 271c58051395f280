#include "sila/predict/outlooks.hpp"

#include <algorithm>
#include <cmath>

#include "sila/model/gait.hpp"
#include "sila/model/outlook.hpp"

namespace sila {
namespace {

/// An outlook that explains less than this share of its signal variance is not heard: it would count that much beside
/// the prior's 1.
constexpr double kLeastWorthHearing = 1e-3;

}  // namespace

Vector2 Foresight::parting_mps(double seconds) const {
  if (partings_mps.empty()) return Vector2::Zero();
  const double place = std::clamp(seconds / knot_interval_s - 1.0, 0.0, static_cast<double>(partings_mps.size() - 1));
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, partings_mps.size() - 1);
  const double share = place - std::floor(place);
  return (1.0 - share) * partings_mps[before] + share * partings_mps[after];
}

std::span<const ExpertOpinion> ask_outlooks(const FieldMap& map, std::span<const int> near,
                                            const CurbTrajectory& observed, Scratch& scratch) {
  if (map.outlook_knots() == 0 || observed.positions.empty()) return {};
  const OutlookState state = outlook_state(observed);
  const auto opinions = scratch.array<ExpertOpinion>(near.size());
  std::size_t count = 0;
  for (const int index : near) {
    const FieldMap::Field& field = map.field(index);
    if (!field.outlook || !field.outlook_reach.contains(state)) continue;
    const Posterior& outlook = *field.outlook;
    const auto mean = scratch.array<double>(outlook.outputs());
    const auto variance =
        outlook.predict_where_known(std::span(state.data(), kOutlookInputs), mean, kLeastWorthHearing);
    if (!variance) continue;
    const double relative = std::max(1e-9, *variance / outlook.signal_variance());
    const double gain = 1.0 / relative - 1.0;
    for (double& value : mean) value /= relative;
    opinions[count++] = {index, gain, gain * outlook.noise_variance() / outlook.signal_variance(), mean};
  }
  return opinions.first(count);
}

Foresight combine(const FieldMap& map, const CurbTrajectory& observed, std::span<const ExpertOpinion> opinions,
                  std::span<const int> excluded, Scratch& scratch) {
  Foresight foresight;
  const auto knots = static_cast<std::size_t>(map.outlook_knots());
  if (knots == 0) return foresight;
  const auto partings = scratch.array<Vector2>(knots);
  std::fill(partings.begin(), partings.end(), Vector2::Zero());
  double gain = 0.0;
  for (const ExpertOpinion& opinion : opinions) {
    if (std::find(excluded.begin(), excluded.end(), opinion.transition) != excluded.end()) continue;
    for (std::size_t knot = 0; knot < knots; ++knot)
      partings[knot] += Vector2(opinion.weighted_mean[2 * knot], opinion.weighted_mean[2 * knot + 1]);
    gain += opinion.gain;
    foresight.evidence += opinion.evidence;
  }
  for (Vector2& parting : partings) parting = velocity_to_world(observed.frame, parting / (1.0 + gain));
  foresight.knot_interval_s = map.outlook_horizon_s() / static_cast<double>(knots);
  foresight.partings_mps = partings;
  return foresight;
}

Foresight consult_gait(const FieldMap& map, bool known_place, const CurbTrajectory& observed, Scratch& scratch) {
  Foresight foresight;
  const std::optional<Posterior>& gait = map.gait(known_place);
  if (!gait || observed.positions.empty()) return foresight;
  const GaitState state = gait_state(observed);
  const auto mean = scratch.array<double>(gait->outputs());
  gait->predict(std::span(state.data(), kGaitInputs), mean);
  const Matrix2 frame = gait_frame(observed);
  const auto partings = scratch.array<Vector2>(mean.size() / 2);
  for (std::size_t knot = 0; knot < partings.size(); ++knot)
    partings[knot] = frame * Vector2(mean[2 * knot], mean[2 * knot + 1]);
  foresight.knot_interval_s = map.outlook_horizon_s() / static_cast<double>(map.outlook_knots());
  foresight.partings_mps = partings;
  return foresight;
}

}  // namespace sila
