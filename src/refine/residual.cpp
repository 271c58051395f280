#include "refine/residual.hpp"

#include <algorithm>
#include <cmath>

#include "core/kinematics.hpp"

namespace sila {
namespace {

constexpr double kMeanVelocityWindow_s = 3.0;

double squared(double value) {
  return value * value;
}

}  // namespace

ResidualInput residual_input(const CurbTrajectory& observed) {
  ResidualInput state;
  state << observed.positions.back(), mean_velocity(observed, kConstantVelocityWindow_s),
      mean_velocity(observed, kMeanVelocityWindow_s);
  return state;
}

std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const ModelSettings& settings, double min_seen_share) {
  const double interval_s = settings.sample_interval_s;
  const double seen_s = static_cast<double>(future_m.size()) * interval_s;
  if (future_m.empty() || seen_s < min_seen_share * settings.residual_horizon_s - 1e-9) return std::nullopt;
  const Eigen::Index outputs = 2 * settings.residual_knots;
  ResidualSample example{observed.times_s.back(), residual_input(observed), Eigen::VectorXd(outputs)};
  const Vector2 constant = mean_velocity(observed, kConstantVelocityWindow_s);
  for (int knot = 0; knot < settings.residual_knots; ++knot) {
    const double due_s = (knot + 1) * settings.residual_horizon_s / settings.residual_knots;
    const auto steps = std::clamp<long>(std::lround(due_s / interval_s), 1, static_cast<long>(future_m.size()));
    const Vector2 way =
        to_curb(observed.frame, future_m[static_cast<std::size_t>(steps - 1)]) - observed.positions.back();
    example.residuals.segment<2>(2 * knot) = way / (static_cast<double>(steps) * interval_s) - constant;
  }
  return example;
}

Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config) {
  const double width_m = settings.reference_width_m;
  Eigen::VectorXd scales(kResidualInputs);
  scales << config.place_scale_m, config.place_scale_m, config.velocity_scale_mps, config.velocity_scale_mps,
      config.mean_velocity_scale_mps, config.mean_velocity_scale_mps;
  return {{squared(config.signal_std_mps / width_m), scales / width_m}, squared(config.noise_std_mps / width_m)};
}

GpConfig residual_gp_config(const ResidualConfig& config) {
  GpConfig gp;
  gp.constant_mean = ConstantMean::zero;
  gp.max_pseudo_inputs = gp.max_fused_pseudo_inputs = config.max_pseudo_inputs;
  gp.selection_stop = config.selection_stop;
  return gp;
}

}  // namespace sila
