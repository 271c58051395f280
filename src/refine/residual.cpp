#include "refine/residual.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/kinematics.hpp"
#include "gp/earlier_gps.hpp"

namespace sila {
namespace {

constexpr double kMeanVelocityWindow_s = 3.0;

/// A residual GP that explains less than this share of its signal variance is left out: it would count that much
/// beside the prior's 1.
constexpr double kMinExplainedShare = 1e-3;

/// This many length scales from a pseudo-input it explains 1e-4 of what it explains at its own position, or less.
constexpr double kReach = 3.1;

Eigen::AlignedBox<double, kResidualInputs> reach_of(const SparseGp& gp) {
  const Eigen::VectorXd reach = kReach * gp.kernel.length_scales;
  return {gp.pseudo_inputs.rowwise().minCoeff() - reach, gp.pseudo_inputs.rowwise().maxCoeff() + reach};
}

}  // namespace

ResidualInput residual_input(const CurbTrajectory& observed) {
  ResidualInput state;
  state << observed.positions.back(), mean_velocity(observed, kConstantVelocityWindow_s),
      mean_velocity(observed, kMeanVelocityWindow_s);
  return state;
}

std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              double interval_s, const ResidualSettings& settings) {
  const double seen_s = static_cast<double>(future_m.size()) * interval_s;
  if (future_m.empty() || seen_s < ResidualConfig::min_seen_share * settings.horizon_s - 1e-9) return std::nullopt;
  const Eigen::Index outputs = 2 * settings.knots;
  ResidualSample sample{observed.times_s.back(), residual_input(observed), Eigen::VectorXd(outputs)};
  const Vector2 constant = mean_velocity(observed, kConstantVelocityWindow_s);
  for (int knot = 0; knot < settings.knots; ++knot) {
    const double due_s = (knot + 1) * settings.horizon_s / settings.knots;
    const auto steps = std::clamp<long>(std::lround(due_s / interval_s), 1, static_cast<long>(future_m.size()));
    const Vector2 way =
        to_curb(observed.frame, future_m[static_cast<std::size_t>(steps - 1)]) - observed.positions.back();
    sample.residuals.segment<2>(2 * knot) = way / (static_cast<double>(steps) * interval_s) - constant;
  }
  return sample;
}

Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config) {
  const double width_m = settings.reference_width_m;
  Eigen::VectorXd scales(kResidualInputs);
  scales << config.place_scale_m, config.place_scale_m, config.velocity_scale_mps, config.velocity_scale_mps,
      config.mean_velocity_scale_mps, config.mean_velocity_scale_mps;
  return {{square(config.signal_std_mps / width_m), scales / width_m}, square(config.noise_std_mps / width_m)};
}

GpConfig residual_gp_config(const ResidualConfig& config) {
  GpConfig gp;
  gp.constant_mean = ConstantMean::zero;
  gp.max_pseudo_inputs = gp.max_fused_pseudo_inputs = config.max_pseudo_inputs;
  gp.selection_stop = config.selection_stop;
  return gp;
}

Vector2 interpolated(const Eigen::Ref<const Eigen::Matrix2Xd>& knots_mps, double interval_s, double seconds) {
  const Eigen::Index last = knots_mps.cols() - 1;
  if (last < 0) return Vector2::Zero();
  const double knot = std::clamp(seconds / interval_s - 1.0, 0.0, static_cast<double>(last));
  const auto before = static_cast<Eigen::Index>(knot);
  const double share = knot - std::floor(knot);
  return (1.0 - share) * knots_mps.col(before) + share * knots_mps.col(std::min(before + 1, last));
}

std::span<const ExpertPrediction> predict_experts(const ResidualIndex& index, std::span<const int> near,
                                                  const CurbTrajectory& observed, Scratch& scratch) {
  if (index.knots() == 0) return {};
  const ResidualInput state = residual_input(observed);
  const auto experts = scratch.array<ExpertPrediction>(near.size());
  std::size_t count = 0;
  for (const int transition : near) {
    const std::optional<ResidualIndex::Expert>& expert = index.expert(transition);
    if (!expert || !expert->reach.contains(state)) continue;
    const Posterior& residual = expert->posterior;
    const auto mean = scratch.array<double>(residual.outputs());
    const auto variance = residual.predict(std::span(state.data(), kResidualInputs), mean, kMinExplainedShare);
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
  const Eigen::Index knots = index.knots();
  if (knots == 0) return residual_prediction;
  const auto numbers = scratch.array<double>(static_cast<std::size_t>(2 * knots));
  auto residuals = Eigen::Matrix2Xd::Map(numbers.data(), 2, knots);
  residuals.setZero();
  double gain = 0.0;
  for (const ExpertPrediction& expert : experts) {
    if (std::find(excluded.begin(), excluded.end(), expert.transition) != excluded.end()) continue;
    residuals += Eigen::Matrix2Xd::Map(expert.weighted_mean.data(), 2, knots);
    gain += expert.gain;
    residual_prediction.effective_samples += expert.effective_samples;
  }
  for (auto residual : residuals.colwise()) residual = velocity_to_world(observed.frame, residual / (1.0 + gain));
  residual_prediction.knot_interval_s = index.horizon_s() / static_cast<double>(knots);
  residual_prediction.residuals_mps = numbers;
  return residual_prediction;
}

ResidualIndex::ResidualIndex(const Model& model, const Model* earlier, const ResidualIndex* of_earlier)
    : knots_(model.refinement.residual_settings.knots),
      horizon_s_(model.refinement.residual_settings.horizon_s),
      experts_(model.transitions.size()) {
  EarlierGps known;
  for (std::size_t i = 0; earlier && i < earlier->transitions.size(); ++i) {
    const SparseGp& gp = entry_of(earlier->refinement.residuals, i);
    if (gp.points > 0.0) known.add(gp, static_cast<int>(i));
  }
  tbb::parallel_for(std::size_t{0}, experts_.size(), [&](std::size_t i) {
    const SparseGp& gp = entry_of(model.refinement.residuals, i);
    if (!(gp.points > 0.0)) return;
    const std::optional<int> same = known.find(gp);
    experts_[i] = same ? of_earlier->expert(*same) : Expert{Posterior(gp), reach_of(gp)};
  });
}

}  // namespace sila
