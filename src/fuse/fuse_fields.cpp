#include "fuse_fields.hpp"

#include <algorithm>

#include "sila/gp/fuse_gps.hpp"
#include "sila/gp/train.hpp"

namespace sila::detail {
namespace {

using Gps = std::vector<const SparseGp*>;

Gps gps_of(const std::vector<const Transition*>& transitions) {
  Gps gps;
  for (const Transition* transition : transitions) gps.push_back(&transition->field.gp);
  return gps;
}

/// Columns of `inputs` and rows of `outputs` of all samples.
GpData pooled(const std::vector<const TransitionSamples*>& samples, Eigen::MatrixXd TransitionSamples::*inputs,
              Eigen::MatrixXd TransitionSamples::*outputs) {
  Eigen::Index points = 0;
  for (const TransitionSamples* part : samples) points += (part->*inputs).cols();
  if (samples.empty()) return {};
  GpData data{Eigen::MatrixXd((samples.front()->*inputs).rows(), points),
              Eigen::MatrixXd(points, (samples.front()->*outputs).cols())};
  Eigen::Index filled = 0;
  for (const TransitionSamples* part : samples) {
    const Eigen::Index count = (part->*inputs).cols();
    data.inputs.middleCols(filled, count) = part->*inputs;
    data.outputs.middleRows(filled, count) = part->*outputs;
    filled += count;
  }
  return data;
}

/// Kernel and noise of GPs: theirs if they agree, otherwise the mean that their fusion takes.
Hyperparameters common_hyperparameters(const Gps& gps, const GpConfig& config) {
  const SparseGp& first = *gps.front();
  const bool agree = std::all_of(gps.begin(), gps.end(), [&first](const SparseGp* gp) {
    return gp->kernel == first.kernel && gp->noise_variance == first.noise_variance;
  });
  if (agree) return {first.kernel, first.noise_variance};
  const SparseGp fused = fuse_gps(gps, {}, config);
  return {fused.kernel, fused.noise_variance};
}

GpData pooled_fields(const std::vector<const TransitionSamples*>& samples) {
  return pooled(samples, &TransitionSamples::positions, &TransitionSamples::velocities);
}

GpData pooled_outlooks(const std::vector<const TransitionSamples*>& samples) {
  return pooled(samples, &TransitionSamples::states, &TransitionSamples::partings);
}

SparseGp fuse_sources(const FieldSources& sources, const GpConfig& config) {
  if (sources.fresh.empty()) return fuse_gps(gps_of(sources.stored), {}, config);
  const Hyperparameters of_data = common_hyperparameters(gps_of(sources.fresh), config);
  if (sources.stored.empty()) return fit_sparse_gp(pooled_fields(sources.samples), of_data, config);
  return fuse_gps(gps_of(sources.stored), pooled_fields(sources.samples), config, of_data);
}

}  // namespace

FieldOrigin origin_of(const FieldSources& sources) {
  if (sources.stored.size() + sources.fresh.size() == 1) return FieldOrigin::copied;
  return sources.stored.empty() ? FieldOrigin::refitted : FieldOrigin::fused;
}

FlowField fuse_fields(const FieldSources& sources, const GpConfig& config) {
  std::vector<const Transition*> all = sources.stored;
  all.insert(all.end(), sources.fresh.begin(), sources.fresh.end());
  if (all.size() == 1) return all.front()->field;
  FlowField field{fuse_sources(sources, config), all.front()->field.extent};
  for (const Transition* transition : all) field.extent.extend(transition->field.extent);
  return field;
}

SparseGp fuse_outlooks(const FieldSources& sources, const GpConfig& config) {
  Gps stored, fresh;
  std::vector<const TransitionSamples*> samples;
  for (const Transition* transition : sources.stored) {
    if (transition->outlook.points > 0.0) stored.push_back(&transition->outlook);
  }
  for (std::size_t i = 0; i < sources.fresh.size(); ++i) {
    if (!(sources.fresh[i]->outlook.points > 0.0)) continue;
    fresh.push_back(&sources.fresh[i]->outlook);
    samples.push_back(sources.samples[i]);
  }
  if (stored.size() + fresh.size() == 0) return {};
  if (stored.size() + fresh.size() == 1) return stored.empty() ? *fresh.front() : *stored.front();
  if (fresh.empty()) return fuse_gps(stored, {}, config);
  return fuse_gps(stored, pooled_outlooks(samples), config, common_hyperparameters(fresh, config));
}

}  // namespace sila::detail
