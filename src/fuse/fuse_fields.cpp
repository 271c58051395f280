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

GpData pooled(const std::vector<const TransitionSamples*>& samples) {
  Eigen::Index points = 0;
  for (const TransitionSamples* part : samples) points += part->positions.cols();
  GpData data{Eigen::MatrixXd(2, points), Eigen::MatrixXd(points, 2)};
  Eigen::Index filled = 0;
  for (const TransitionSamples* part : samples) {
    data.inputs.middleCols(filled, part->positions.cols()) = part->positions;
    data.outputs.middleRows(filled, part->positions.cols()) = part->velocities;
    filled += part->positions.cols();
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
  const SparseGp fused = fuse_gps(gps, pooled({}), config);
  return {fused.kernel, fused.noise_variance};
}

SparseGp fuse_sources(const FieldSources& sources, const GpConfig& config) {
  if (sources.fresh.empty()) return fuse_gps(gps_of(sources.stored), pooled({}), config);
  const Hyperparameters of_data = common_hyperparameters(gps_of(sources.fresh), config);
  if (sources.stored.empty()) return fit_sparse_gp(pooled(sources.samples), of_data, config);
  return fuse_gps(gps_of(sources.stored), pooled(sources.samples), config, of_data);
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

}  // namespace sila::detail
