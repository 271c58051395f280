#include "sila/model/outlook.hpp"

#include <algorithm>
#include <cmath>

#include "sila/core/kinematics.hpp"
#include "sila/model/gait.hpp"

namespace sila {
namespace {

constexpr double kMeanVelocityWindow_s = 3.0;

double square(double value) {
  return value * value;
}

}  // namespace

OutlookState outlook_state(const CurbTrajectory& observed) {
  OutlookState state;
  state << observed.positions.back(), mean_velocity(observed, kConstantVelocityWindow_s),
      mean_velocity(observed, kMeanVelocityWindow_s);
  return state;
}

std::optional<OutlookExample> outlook_example(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const Conventions& conventions, double min_seen_share) {
  const double interval_s = conventions.sample_interval_s;
  const double seen_s = static_cast<double>(future_m.size()) * interval_s;
  if (future_m.empty() || seen_s < min_seen_share * conventions.outlook_horizon_s - 1e-9) return std::nullopt;
  const Eigen::Index outputs = 2 * conventions.outlook_knots;
  OutlookExample example{observed.times_s.back(), outlook_state(observed), Eigen::VectorXd(outputs),
                         gait_state(observed), Eigen::VectorXd(outputs)};
  const Matrix2 to_gait = gait_frame(observed).transpose() * world_from_curb(observed.frame);
  const Vector2 constant = mean_velocity(observed, kConstantVelocityWindow_s);
  for (int knot = 0; knot < conventions.outlook_knots; ++knot) {
    const double due_s = (knot + 1) * conventions.outlook_horizon_s / conventions.outlook_knots;
    const auto steps = std::clamp<long>(std::lround(due_s / interval_s), 1, static_cast<long>(future_m.size()));
    const Vector2 way =
        to_curb(observed.frame, future_m[static_cast<std::size_t>(steps - 1)]) - observed.positions.back();
    example.partings.segment<2>(2 * knot) = way / (static_cast<double>(steps) * interval_s) - constant;
    example.gait_partings.segment<2>(2 * knot) = to_gait * example.partings.segment<2>(2 * knot);
  }
  return example;
}

Hyperparameters outlook_hyperparameters(const Conventions& conventions, const OutlookConfig& config) {
  const double width_m = conventions.reference_width_m;
  Eigen::VectorXd scales(kOutlookInputs);
  scales << config.place_scale_m, config.place_scale_m, config.velocity_scale_mps, config.velocity_scale_mps,
      config.mean_velocity_scale_mps, config.mean_velocity_scale_mps;
  return {{square(config.signal_std_mps / width_m), scales / width_m}, square(config.noise_std_mps / width_m)};
}

GpConfig outlook_gp_config(const OutlookConfig& config) {
  GpConfig gp;
  gp.constant_mean = ConstantMean::zero;
  gp.max_pseudo_inputs = gp.max_fused_pseudo_inputs = config.max_pseudo_inputs;
  gp.selection_stop = config.selection_stop;
  gp.settled_share = config.settled_share;
  return gp;
}

}  // namespace sila
