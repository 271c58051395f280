#include <algorithm>

#include "fuse/steps.hpp"
#include "gp/fuse_gps.hpp"

namespace sila {
std::pair<const Model*, std::size_t> source_of(std::pair<int, int> edge, const Model& previous, const Model& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  const bool first = edge.first < shift;
  if (!first) edge = {edge.first - shift, edge.second - shift};
  const std::vector<Transition>& list = (first ? previous : incoming).transitions;
  const auto key = [](const Transition& transition) { return std::pair(transition.from, transition.to); };
  const auto found = std::ranges::lower_bound(list, edge, {}, key);
  return {first ? &previous : &incoming, static_cast<std::size_t>(found - list.begin())};
}

std::vector<FieldSource> sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming) {
  std::vector<FieldSource> sources;
  for (const std::pair<int, int>& edge : group.sources) {
    const auto [model, index] = source_of(edge, previous, incoming.model);
    const bool has_samples =
        model != &previous && !incoming.samples.empty() && incoming.samples[index].inputs.cols() > 0;
    sources.push_back({&model->transitions[index], has_samples ? &incoming.samples[index] : nullptr});
  }
  return sources;
}

FlowField fuse_fields(std::span<const FieldSource> sources, const GpConfig& config) {
  FlowField field = sources.front().transition->field;
  if (sources.size() == 1) return field;
  const bool independent = field.independent();
  const auto fused = [&](Eigen::Index component) {
    std::vector<GpSource> gps;
    std::vector<GpData> data(sources.size());  // of this component
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const auto& [transition, samples] = sources[i];
      if (samples && independent) data[i] = {samples->inputs, samples->outputs.col(component)};
      gps.push_back({component == 0 ? &transition->field.gp : transition->field.second(),
                     samples && independent ? &data[i] : samples});
    }
    return fuse_sources(gps, config);
  };
  field.gp = fused(0);
  if (independent) field.gp_y = fused(1);
  for (const FieldSource& source : sources) field.extent.extend(source.transition->field.extent);
  return field;
}

}  // namespace sila
