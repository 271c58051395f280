#include "refine/global_residual.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/kinematics.hpp"
#include "gp/fuse_gps.hpp"

namespace sila {
namespace {

constexpr double kStanding_mps = 1e-6;
/// Length scales of the inputs, in their order and in units of `global_scale_mps`: larger for longer windows.
constexpr std::array<double, kGlobalResidualInputs> kScales = {1.0,       1.0,       1.0,      4.0 / 3.0,
                                                               4.0 / 3.0, 5.0 / 3.0, 5.0 / 3.0};
constexpr double kSelectionStop = 0.03;
/// Signs of the inputs when mirrored.
constexpr std::array<double, kGlobalResidualInputs> kMirror = {1, -1, 1, 1, -1, 1, -1};

Hyperparameters global_residual_hyperparameters(const ResidualConfig& config) {
  const double variance = config.signal_std_mps * config.signal_std_mps;
  const Eigen::Map<const Eigen::VectorXd> scales(kScales.data(), kGlobalResidualInputs);
  return {{variance, config.global_scale_mps * scales}, variance};
}

GpConfig global_residual_gp_config(const ResidualConfig& config) {
  GpConfig gp;
  gp.constant_mean = ConstantMean::zero;
  gp.max_pseudo_inputs = gp.max_fused_pseudo_inputs = config.global_pseudo_inputs;
  gp.selection_stop = kSelectionStop;
  return gp;
}

}  // namespace

Matrix2 heading_frame(const CurbTrajectory& observed) {
  const Vector2 velocity_mps = mean_velocity_mps(observed, kConstantVelocityWindow_s);
  const double speed_mps = velocity_mps.norm();
  const Vector2 ahead = speed_mps > kStanding_mps ? Vector2(velocity_mps / speed_mps) : Vector2(Vector2::UnitX());
  Matrix2 frame;
  frame << ahead, left_of(ahead);
  return frame;
}

GlobalResidualInput global_residual_input(const CurbTrajectory& observed) {
  const Matrix2 frame = heading_frame(observed);
  const auto seen = [&](double window_s) { return Vector2(frame.transpose() * mean_velocity_mps(observed, window_s)); };
  GlobalResidualInput state;
  state << seen(0.4), seen(kConstantVelocityWindow_s).x(), seen(1.6), seen(3.0);
  return state;
}

GlobalResidualSamples global_residual_samples(const std::vector<const ResidualSample*>& examples) {
  const auto count = static_cast<Eigen::Index>(examples.size());
  const Eigen::Index outputs = examples.empty() ? 0 : examples.front()->global_residuals_mps.size();
  GlobalResidualSamples samples{Eigen::MatrixXd(kGlobalResidualInputs, 2 * count), Eigen::MatrixXd(2 * count, outputs)};
  const auto mirror = Eigen::Map<const Eigen::VectorXd>(kMirror.data(), kGlobalResidualInputs);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ResidualSample& example = *examples[static_cast<std::size_t>(i)];
    samples.inputs.col(2 * i) = example.global_residual;
    samples.inputs.col(2 * i + 1) = example.global_residual.cwiseProduct(mirror);
    samples.outputs.row(2 * i) = example.global_residuals_mps.transpose();
    samples.outputs.row(2 * i + 1) = example.global_residuals_mps.transpose();
    for (Eigen::Index left = 1; left < outputs; left += 2) samples.outputs(2 * i + 1, left) *= -1.0;
  }
  return samples;
}

GlobalResidualSamples join_samples(const std::vector<GlobalResidualSamples>& parts) {
  Eigen::Index count = 0, outputs = 0;
  for (const GlobalResidualSamples& part : parts) {
    count += part.inputs.cols();
    outputs = std::max(outputs, part.outputs.cols());
  }
  GlobalResidualSamples all{Eigen::MatrixXd(kGlobalResidualInputs, count), Eigen::MatrixXd(count, outputs)};
  Eigen::Index filled = 0;
  for (const GlobalResidualSamples& part : parts) {
    const Eigen::Index more = part.inputs.cols();
    if (more == 0) continue;
    all.inputs.middleCols(filled, more) = part.inputs;
    all.outputs.middleRows(filled, more) = part.outputs;
    filled += more;
  }
  return all;
}

SparseGp learn_global_residual(const SparseGp& known, const GlobalResidualSamples& samples,
                               const ResidualConfig& config) {
  if (samples.inputs.cols() == 0) return known;
  if (!(known.points > 0.0)) {
    return fuse_gps({}, {samples.inputs, samples.outputs}, global_residual_gp_config(config),
                    global_residual_hyperparameters(config));
  }
  if (known.pseudo_inputs.cols() >= config.global_pseudo_inputs)
    return condition(known, samples.inputs, samples.outputs);
  const std::array<const SparseGp*, 1> parts = {&known};
  return fuse_gps(parts, {samples.inputs, samples.outputs}, global_residual_gp_config(config),
                  global_residual_hyperparameters(config));
}

SparseGp merge_global_residuals(const SparseGp& a, const SparseGp& b, const ResidualConfig& config) {
  if (!(a.points > 0.0)) return b;
  if (!(b.points > 0.0)) return a;
  const std::array<const SparseGp*, 2> parts = {&a, &b};
  return fuse_gps(parts, {}, global_residual_gp_config(config));
}

SparseGp untrained_global_residual(SparseGp global_residual, double most_examples) {
  const double share = most_examples / global_residual.points;
  return share < 1.0 ? discount(std::move(global_residual), share) : global_residual;
}

}  // namespace sila
