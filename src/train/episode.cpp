#include "sila/train/episode.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "refine/refine.hpp"
#include "refine/residual.hpp"
#include "sila/core/counted.hpp"
#include "sila/core/sampling.hpp"
#include "sila/model/packing.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

/// The samples of one track for residual GPs.
std::vector<ResidualSample> samples_of(const FramedTrajectory& track, const ModelSettings& settings,
                                       const EpisodeConfig& config) {
  std::vector<ResidualSample> samples;
  for (const Window& window :
       windows_of(std::span(&track, 1), config.sampling, config.predict, config.residual.stride_s)) {
    auto sample = residual_sample(window.observed, window.future_m, settings, config.residual.min_seen_share);
    if (sample) samples.push_back(*std::move(sample));
  }
  return samples;
}

/// The tracks in curb coordinates and their samples for residual GPs.
Batch prepared(std::span<const FramedTrajectory> tracks, const ModelSettings& settings, const EpisodeConfig& config) {
  Batch batch;
  for (const FramedTrajectory& framed : tracks) {
    batch.tracks.push_back(resample(framed.track, framed.frame, config.sampling));
    if (config.residual.enabled) batch.residuals.push_back(samples_of(framed, settings, config));
  }
  return batch;
}

/// M'(n).
LearnResult increment_of(const Batch& batch, const ModelSettings& settings, const EpisodeConfig& config) {
  return learn(batch, settings, config.learn, config.residual, config.fuse.sites);
}

std::vector<EpisodeId> joined(const std::vector<EpisodeId>& a, const std::vector<EpisodeId>& b) {
  std::vector<EpisodeId> all;
  std::ranges::set_union(a, b, std::back_inserter(all));
  return all;
}

void require_nothing_shared(const Model& previous, const Model& incoming) {
  std::vector<EpisodeId> shared;
  std::ranges::set_intersection(previous.episode_ids, incoming.episode_ids, std::back_inserter(shared));
  if (shared.empty()) return;
  throw std::invalid_argument("fuse: both models have learnt " + counted(shared.size(), "episode") + " (such as " +
                              to_text(shared.front()) +
                              "), which would count twice; learn one of the models anew without these tracks");
}

/// The prior of two models, of which one may have none.
const ErrorStatistics& common_prior(const Model& previous, const Model& incoming) {
  if (previous.prior.empty() || incoming.prior.empty()) return previous.prior.empty() ? incoming.prior : previous.prior;
  if (!std::ranges::equal(pack(previous.prior), pack(incoming.prior)))
    throw std::invalid_argument(
        "fuse: the models began with different priors; learn one of them anew from a copy of the other's prior");
  return previous.prior;
}

/// What an update gives; the episode around it adds the rest of the report.
Episode updated(Model model, const LearnReport& learnt, ModelChange change, const PruneReport& pruned = {}) {
  Episode episode{std::move(model), {}};
  episode.report.learn = learnt;
  episode.report.prune = pruned;
  episode.report.change = std::move(change);
  return episode;
}

}  // namespace

void set_error_statistics(std::vector<Site>& sites, const std::vector<Site>& previous, const std::vector<Site>& recent,
                          double memory_windows) {
  const auto error_statistics_in = [](const std::vector<Site>& of, const CurbFrame& frame) {
    const auto site = find_site(of, frame);
    return site ? of[static_cast<std::size_t>(*site)].error_statistics : ErrorStatistics{};
  };
  for (Site& site : sites) {
    site.error_statistics = add_error_statistics(error_statistics_in(previous, site.frame),
                                                 error_statistics_in(recent, site.frame), memory_windows);
  }
  require_one_shape(sites);
}

Update sila_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);                   // M'(n)
    FuseResult fused = fuse(previous, incoming.increment, config.fuse, config.residual);  // M(n)
    ModelChange change = change_by(fused.plan, previous, fused.model);
    PruneResult pruned = prune(std::move(fused.model), config.prune, config.fuse, config.residual);
    change = without_dropped(std::move(change), pruned.kept);
    return updated(std::move(pruned.model), incoming.report, std::move(change), pruned.report);
  };
}

Update accumulate_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);
    FuseResult sum = accumulate(previous, incoming.increment, config.residual);
    ModelChange change = change_by(sum.plan, previous, sum.model);
    return updated(std::move(sum.model), incoming.report, std::move(change));
  };
}

Update retrain_update(const EpisodeConfig& config) {
  auto seen = std::make_shared<Batch>();
  return [config, seen](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    seen->tracks.insert(seen->tracks.end(), batch.tracks.begin(), batch.tracks.end());
    seen->residuals.insert(seen->residuals.end(), batch.residuals.begin(), batch.residuals.end());
    LearnResult learnt = increment_of(*seen, settings, config);
    learnt.increment.model.episodes = previous.episodes + 1;
    ModelChange change = change_by_retraining(previous, learnt.increment.model);
    return updated(std::move(learnt.increment.model), learnt.report, std::move(change));
  };
}

Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update, const Predictor* of_previous) {
  validate(config);
  if (batch.empty()) return {previous, {}};
  const auto start = std::chrono::steady_clock::now();
  const ModelSettings settings = settings_for(previous, batch.front().frame, config);
  const EpisodeId id = episode_id(batch);
  if (std::ranges::binary_search(previous.episode_ids, id)) {
    Episode known{previous, {}};
    known.report.known = true;
    known.report.size_before = known.report.size_after = size(previous);
    return known;
  }
  BatchErrors recent;
  if (config.error_statistics.enabled)
    recent = recent_errors(previous, batch, config, settings == previous.settings ? of_previous : nullptr);
  const Batch in_curb_frame = prepared(batch, settings, config);
  Episode episode = (update ? update : sila_update(config))(previous, in_curb_frame, settings);
  set_error_statistics(episode.model.sites, previous.sites, recent.sites, config.error_statistics.memory_windows);
  episode.model.sharing = config.fuse.sites;
  episode.model.prior = previous.prior;
  BudgetResult within = apply_budget(std::move(episode.model), config.budget);
  within.model.episode_ids = joined(previous.episode_ids, {id});
  EpisodeReport& report = episode.report;
  report.tracks = static_cast<int>(batch.size());
  report.size_before = size(previous);
  report.size_after = size(within.model);
  report.budget = within.report;
  report.change = without_dropped(std::move(report.change), within.kept);
  report.prequential = recent.path;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {std::move(within.model), std::move(report)};
}

FuseResult fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
                       const ResidualConfig& residual) {
  require_nothing_shared(previous, incoming);
  const double ours_m = previous.settings.reference_width_m, theirs_m = incoming.settings.reference_width_m;
  const bool by_width =
      previous.settings.scaling != CurbScaling::metres && previous.settings.scaling == incoming.settings.scaling;
  if (by_width && previous.episodes > 0 && incoming.episodes > 0 && ours_m != theirs_m) {
    throw std::invalid_argument("fuse: previous began with a sidewalk width of " + std::to_string(ours_m) +
                                " m, incoming with " + std::to_string(theirs_m) +
                                " m; models that are to be fused must begin with one reference_width_m");
  }
  FuseResult fused = fuse(previous, {incoming, {}}, config, residual);
  fused.model.prior = common_prior(previous, incoming);
  fused.model.episode_ids = joined(previous.episode_ids, incoming.episode_ids);
  return fused;
}

}  // namespace sila
