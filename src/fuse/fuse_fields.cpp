#include "fuse/fuse_fields.hpp"

#include <algorithm>

#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"

namespace sila {
namespace {

using Gps = std::vector<const SparseGp*>;

/// The part of a field that one GP represents.
enum class Part { both, x, y };

Gps gps_of(const std::vector<const Transition*>& transitions, Part part) {
  Gps gps;
  for (const Transition* transition : transitions)
    gps.push_back(part == Part::y ? transition->field.second() : &transition->field.gp);
  return gps;
}

GpData pooled_fields(const std::vector<const TransitionSamples*>& samples, Part part) {
  GpData data = pooled(samples, &TransitionSamples::positions, &TransitionSamples::velocities);
  if (part != Part::both) data.outputs = data.outputs.col(part == Part::y ? 1 : 0).eval();
  return data;
}

SparseGp fuse_sources(const FieldSources& sources, const GpConfig& config, Part part) {
  if (sources.fresh.empty()) return fuse_gps(gps_of(sources.stored, part), {}, config);
  const Hyperparameters of_data = fused_hyperparameters(gps_of(sources.fresh, part));
  const GpData data = pooled_fields(sources.samples, part);
  if (sources.stored.empty()) return fit_sparse_gp(data, of_data, config);
  return fuse_gps(gps_of(sources.stored, part), data, config, of_data);
}

}  // namespace

const Transition& transition_at(const Model& model, std::pair<int, int> edge) {
  return *std::ranges::lower_bound(model.transitions, edge, {}, [](const Transition& transition) {
    return std::pair(transition.from, transition.to);
  });
}

FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  FieldSources sources;
  for (const auto& [from, to] : group.sources) {
    if (from < shift) {
      sources.stored.push_back(&transition_at(previous, {from, to}));
      continue;
    }
    const Transition& transition = transition_at(incoming.model, {from - shift, to - shift});
    const auto index = static_cast<std::size_t>(&transition - incoming.model.transitions.data());
    const bool has_samples = !incoming.samples.empty() && incoming.samples[index].positions.cols() > 0;
    (has_samples ? sources.fresh : sources.stored).push_back(&transition);
    if (has_samples) sources.samples.push_back(&incoming.samples[index]);
  }
  return sources;
}

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

FlowField fuse_fields(const FieldSources& sources, const GpConfig& config) {
  std::vector<const Transition*> all = sources.stored;
  all.insert(all.end(), sources.fresh.begin(), sources.fresh.end());
  if (all.size() == 1) return all.front()->field;
  const bool independent = all.front()->field.independent();
  FlowField field{fuse_sources(sources, config, independent ? Part::x : Part::both), all.front()->field.extent};
  if (independent) field.gp_y = fuse_sources(sources, config, Part::y);
  for (const Transition* transition : all) field.extent.extend(transition->field.extent);
  return field;
}

}  // namespace sila
