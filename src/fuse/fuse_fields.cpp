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

std::pair<const Model*, std::size_t> source_of(std::pair<int, int> edge, const Model& previous, const Model& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  const bool first = edge.first < shift;
  if (!first) edge = {edge.first - shift, edge.second - shift};
  const std::vector<Transition>& list = (first ? previous : incoming).transitions;
  const auto key = [](const Transition& transition) { return std::pair(transition.from, transition.to); };
  const auto found = std::ranges::lower_bound(list, edge, {}, key);
  return {first ? &previous : &incoming, static_cast<std::size_t>(found - list.begin())};
}

FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming) {
  FieldSources sources;
  for (const std::pair<int, int>& edge : group.sources) {
    const auto [model, index] = source_of(edge, previous, incoming.model);
    const bool has_samples =
        model != &previous && !incoming.samples.empty() && incoming.samples[index].positions.cols() > 0;
    (has_samples ? sources.fresh : sources.stored).push_back(&model->transitions[index]);
    if (has_samples) sources.samples.push_back(&incoming.samples[index]);
  }
  return sources;
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
