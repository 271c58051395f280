#include "refine/residuals.hpp"

#include <algorithm>
#include <cmath>

#include "refine/residual.hpp"

namespace sila {
namespace {

/// A residual GP that explains less than this share of its signal variance is left out: it would count that much
/// beside the prior's 1.
constexpr double kMinExplainedShare = 1e-3;

}  // namespace

Vector2 ResidualPrediction::residual_mps(double seconds) const {
  if (residuals_mps.empty()) return Vector2::Zero();
  const double place = std::clamp(seconds / knot_interval_s - 1.0, 0.0, static_cast<double>(residuals_mps.size() - 1));
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, residuals_mps.size() - 1);
  const double share = place - std::floor(place);
  return (1.0 - share) * residuals_mps[before] + share * residuals_mps[after];
}

std::span<const ExpertPrediction> predict_experts(const ResidualIndex& index, std::span<const int> near,
                                                  const CurbTrajectory& observed, Scratch& scratch) {
  if (index.knots() == 0 || observed.positions.empty()) return {};
  const ResidualInput state = residual_input(observed);
  const auto experts = scratch.array<ExpertPrediction>(near.size());
  std::size_t count = 0;
  for (const int transition : near) {
    const std::optional<ResidualIndex::Expert>& expert = index.expert(transition);
    if (!expert || !expert->reach.contains(state)) continue;
    const Posterior& residual = expert->posterior;
    const auto mean = scratch.array<double>(residual.outputs());
    const auto variance =
        residual.predict_if_explained(std::span(state.data(), kResidualInputs), mean, kMinExplainedShare);
    if (!variance) continue;
    const double relative = std::max(1e-9, *variance / residual.signal_variance());
    const double gain = 1.0 / relative - 1.0;
    for (double& value : mean) value /= relative;
    experts[count++] = {transition, gain, gain * residual.noise_variance() / residual.signal_variance(), mean};
  }
  return experts.first(count);
}

ResidualPrediction combine(const ResidualIndex& index, const CurbTrajectory& observed,
                           std::span<const ExpertPrediction> experts, std::span<const int> excluded, Scratch& scratch) {
  ResidualPrediction residual_prediction;
  const auto knots = static_cast<std::size_t>(index.knots());
  if (knots == 0) return residual_prediction;
  const auto residuals = scratch.array<Vector2>(knots);
  std::fill(residuals.begin(), residuals.end(), Vector2::Zero());
  double gain = 0.0;
  for (const ExpertPrediction& expert : experts) {
    if (std::find(excluded.begin(), excluded.end(), expert.transition) != excluded.end()) continue;
    for (std::size_t knot = 0; knot < knots; ++knot)
      residuals[knot] += Vector2(expert.weighted_mean[2 * knot], expert.weighted_mean[2 * knot + 1]);
    gain += expert.gain;
    residual_prediction.effective_samples += expert.effective_samples;
  }
  for (Vector2& residual : residuals) residual = velocity_to_world(observed.frame, residual / (1.0 + gain));
  residual_prediction.knot_interval_s = index.horizon_s() / static_cast<double>(knots);
  residual_prediction.residuals_mps = residuals;
  return residual_prediction;
}

}  // namespace sila
