#include "sila/model/gait.hpp"

#include <array>
#include <utility>

#include "sila/core/kinematics.hpp"
#include "sila/gp/fuse_gps.hpp"

namespace sila {
namespace {

constexpr double kStanding_mps = 1e-6;
/// Velocities this near are alike, in the order of the inputs and in units of `gait_scale_mps`: the longer the window,
/// the more room.
constexpr std::array<double, kGaitInputs> kScales = {1.0, 1.0, 1.0, 4.0 / 3.0, 4.0 / 3.0, 5.0 / 3.0, 5.0 / 3.0};
constexpr double kSelectionStop = 0.03;
/// How the inputs look in a mirror.
constexpr std::array<double, kGaitInputs> kMirror = {1, -1, 1, 1, -1, 1, -1};

Hyperparameters gait_hyperparameters(const OutlookConfig& config) {
  const double variance = config.signal_std_mps * config.signal_std_mps;
  const Eigen::Map<const Eigen::VectorXd> scales(kScales.data(), kGaitInputs);
  return {{variance, config.gait_scale_mps * scales}, variance};
}

GpConfig gait_gp_config(const OutlookConfig& config) {
  GpConfig gp;
  gp.constant_mean = ConstantMean::zero;
  gp.max_pseudo_inputs = gp.max_fused_pseudo_inputs = config.gait_pseudo_inputs;
  gp.selection_stop = kSelectionStop;
  gp.settled_share = config.settled_share;
  return gp;
}

}  // namespace

Matrix2 gait_frame(const CurbTrajectory& observed) {
  const Vector2 velocity_mps = mean_velocity_mps(observed, kConstantVelocityWindow_s);
  const double speed_mps = velocity_mps.norm();
  const Vector2 ahead = speed_mps > kStanding_mps ? Vector2(velocity_mps / speed_mps) : Vector2(Vector2::UnitX());
  Matrix2 frame;
  frame << ahead, Vector2(-ahead.y(), ahead.x());
  return frame;
}

GaitState gait_state(const CurbTrajectory& observed) {
  const Matrix2 frame = gait_frame(observed);
  const auto seen = [&](double window_s) { return Vector2(frame.transpose() * mean_velocity_mps(observed, window_s)); };
  GaitState state;
  state << seen(0.4), seen(kConstantVelocityWindow_s).x(), seen(1.6), seen(3.0);
  return state;
}

GaitSamples gait_samples(const std::vector<const OutlookExample*>& examples) {
  const auto count = static_cast<Eigen::Index>(examples.size());
  const Eigen::Index outputs = examples.empty() ? 0 : examples.front()->gait_partings.size();
  GaitSamples samples{Eigen::MatrixXd(kGaitInputs, 2 * count), Eigen::MatrixXd(2 * count, outputs)};
  const auto mirror = Eigen::Map<const Eigen::VectorXd>(kMirror.data(), kGaitInputs);
  for (Eigen::Index i = 0; i < count; ++i) {
    const OutlookExample& example = *examples[static_cast<std::size_t>(i)];
    samples.inputs.col(2 * i) = example.gait;
    samples.inputs.col(2 * i + 1) = example.gait.cwiseProduct(mirror);
    samples.outputs.row(2 * i) = example.gait_partings.transpose();
    samples.outputs.row(2 * i + 1) = example.gait_partings.transpose();
    for (Eigen::Index left = 1; left < outputs; left += 2) samples.outputs(2 * i + 1, left) *= -1.0;
  }
  return samples;
}

SparseGp learn_gait(const SparseGp& known, const GaitSamples& samples, const OutlookConfig& config) {
  if (samples.inputs.cols() == 0) return known;
  if (!(known.points > 0.0)) {
    return fuse_gps({}, {samples.inputs, samples.outputs}, gait_gp_config(config), gait_hyperparameters(config));
  }
  if (known.pseudo_inputs.cols() >= config.gait_pseudo_inputs) return absorb(known, samples.inputs, samples.outputs);
  const std::array<const SparseGp*, 1> parts = {&known};
  return fuse_gps(parts, {samples.inputs, samples.outputs}, gait_gp_config(config), gait_hyperparameters(config));
}

SparseGp fuse_gaits(const SparseGp& a, const SparseGp& b, const OutlookConfig& config) {
  if (!(a.points > 0.0)) return b;
  if (!(b.points > 0.0)) return a;
  const std::array<const SparseGp*, 2> parts = {&a, &b};
  return fuse_gps(parts, {}, gait_gp_config(config));
}

SparseGp gait_elsewhere(SparseGp gait, double most_examples) {
  const double share = most_examples / gait.points;
  return share < 1.0 ? weighted(std::move(gait), share) : gait;
}

}  // namespace sila
