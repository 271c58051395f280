#include "refine/refine.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <utility>

#include "fuse/steps.hpp"
#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "learn/steps.hpp"
#include "refine/residual.hpp"

namespace sila {
namespace {

/// The transition at a sample: from its segment to the next one; in the last segment the transition that led there.
TransitionKey key_at(const std::vector<Segment>& segments, std::size_t sample) {
  std::size_t s = 0;
  while (s + 1 < segments.size() && sample >= segments[s].end) ++s;
  if (s + 1 < segments.size()) return {segments[s].primitive, segments[s + 1].primitive};
  return {segments[s > 0 ? s - 1 : s].primitive, segments[s].primitive};
}

/// The index of the sample of a track at a time.
std::size_t sample_at(const CurbTrajectory& track, double time_s) {
  const auto later = std::lower_bound(track.times_s.begin(), track.times_s.end(), time_s - 1e-9);
  return std::min(static_cast<std::size_t>(later - track.times_s.begin()), track.times_s.size() - 1);
}

/// States to residuals. Shapes: 6 x m, m x 2 per knot.
GpData data_of(const std::vector<const ResidualSample*>& samples) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  GpData data{Eigen::MatrixXd(kResidualInputs, count), Eigen::MatrixXd(count, samples.front()->residuals.size())};
  for (Eigen::Index i = 0; i < count; ++i) {
    data.inputs.col(i) = samples[static_cast<std::size_t>(i)]->state;
    data.outputs.row(i) = samples[static_cast<std::size_t>(i)]->residuals.transpose();
  }
  return data;
}

/// The data of each transition: the samples of the moments at which a pedestrian was in its first primitive and went on
/// to its second (or had come from the first, if the track ends in the second). Tracks without segments give none.
std::map<TransitionKey, GpData> residual_data_of(const Batch& batch, std::span<const std::vector<Segment>> segments) {
  std::map<TransitionKey, std::vector<const ResidualSample*>> samples;
  for (std::size_t i = 0; i < batch.residuals.size(); ++i) {
    if (segments[i].empty()) continue;
    for (const ResidualSample& sample : batch.residuals[i])
      samples[key_at(segments[i], sample_at(batch.tracks[i], sample.t0_s))].push_back(&sample);
  }
  std::map<TransitionKey, GpData> data;
  for (const auto& [key, list] : samples) data[key] = data_of(list);
  return data;
}

FuseResult with_residuals(FuseResult fused, const Model& previous, const Increment& incoming,
                          const ResidualConfig& config) {
  Refinement& refinement = fused.model.refinement;
  refinement.residual_settings = (previous.empty() ? incoming.model : previous).refinement.residual_settings;
  refinement.residuals.resize(fused.plan.groups.size());
  tbb::parallel_for(std::size_t{0}, fused.plan.groups.size(), [&](std::size_t g) {
    std::vector<GpSource> sources;
    for (const std::pair<int, int>& edge : fused.plan.groups[g].sources) {
      const auto [model, index] = source_of(edge, previous, incoming.model);
      const bool has_samples = model != &previous && !incoming.residual_samples.empty();
      sources.push_back(
          {&entry_of(model->refinement.residuals, index), has_samples ? &incoming.residual_samples[index] : nullptr});
    }
    refinement.residuals[g] = fuse_sources(sources, residual_gp_config(config));
  });
  return fused;
}

LearnResult with_residuals(LearnResult learnt, const Batch& batch, const ResidualConfig& config) {
  Increment& increment = learnt.increment;
  Model& model = increment.model;
  Refinement& refinement = model.refinement;
  refinement.residual_settings = batch.residual_settings;
  refinement.residuals.resize(model.transitions.size());
  increment.residual_samples.resize(model.transitions.size());
  const Hyperparameters hyperparameters = residual_hyperparameters(model.settings, config);
  std::map<TransitionKey, GpData> data = residual_data_of(batch, learnt.segments);
  tbb::parallel_for(std::size_t{0}, model.transitions.size(), [&](std::size_t i) {
    const auto found = data.find({model.transitions[i].from, model.transitions[i].to});
    if (found == data.end()) return;
    refinement.residuals[i] = fit_sparse_gp(found->second, hyperparameters, residual_gp_config(config));
    increment.residual_samples[i] = std::move(found->second);
  });
  return learnt;
}

}  // namespace

LearnResult learn(const Batch& batch, const ModelSettings& settings, const LearnConfig& config,
                  const ResidualConfig& residual, SiteSharing sharing) {
  return with_residuals(learn(batch.tracks, settings, config, sharing), batch, residual);
}

FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config,
                const ResidualConfig& residual) {
  return with_residuals(fuse(previous, incoming, config), previous, incoming, residual);
}

FuseResult accumulate(const Model& previous, const Increment& incoming, const ResidualConfig& residual) {
  return with_residuals(accumulate(previous, incoming), previous, incoming, residual);
}

}  // namespace sila
