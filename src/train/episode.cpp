#include "sila/train/episode.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "core/concatenate.hpp"
#include "refine/refine.hpp"
#include "refine/residual.hpp"
#include "sila/core/counted.hpp"
#include "sila/core/sampling.hpp"
#include "sila/model/packing.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

/// The samples of one track for residual GPs.
std::vector<ResidualSample> samples_of(const FramedTrajectory& track, const ResidualSettings& settings,
                                       const EpisodeConfig& config) {
  std::vector<ResidualSample> samples;
  for (const Window& window :
       windows_of(std::span(&track, 1), config.sampling, config.predict, config.residual.stride_s)) {
    auto sample = residual_sample(window.observed, window.future_m, config.sampling.interval_s, settings);
    if (sample) samples.push_back(*std::move(sample));
  }
  return samples;
}

/// The tracks in curb coordinates and their samples for residual GPs.
Batch prepared(std::span<const FramedTrajectory> tracks, const Model& previous, const EpisodeConfig& config) {
  Batch batch;
  if (previous.episodes > 0)
    batch.residual_settings = previous.refinement.residual_settings;
  else if (config.residual.enabled)
    batch.residual_settings = {config.predict.horizon_s, config.residual.knots};
  for (const FramedTrajectory& framed : tracks) {
    batch.tracks.push_back(resample(framed.track, framed.frame, config.sampling));
    if (config.residual.enabled) batch.residuals.push_back(samples_of(framed, batch.residual_settings, config));
  }
  return batch;
}

/// M'(n).
LearnResult increment_of(const Batch& batch, const ModelSettings& settings, const EpisodeConfig& config) {
  return learn(batch, settings, config.learn, config.residual, config.fuse.sites);
}

std::vector<EpisodeId> union_of(const std::vector<EpisodeId>& a, const std::vector<EpisodeId>& b) {
  std::vector<EpisodeId> all;
  std::ranges::set_union(a, b, std::back_inserter(all));
  return all;
}

void require_nothing_shared(const Model& previous, const Model& incoming) {
  std::vector<EpisodeId> shared;
  std::ranges::set_intersection(previous.episode_ids, incoming.episode_ids, std::back_inserter(shared));
  if (shared.empty()) return;
  throw invalid_argument("fuse: both models have learnt ", counted(shared.size(), "episode"), " (such as ",
                         to_text(shared.front()),
                         "), which would count twice; learn one of the models anew without these tracks");
}

/// The prior of two models, of which one may have none.
const ErrorStatistics& common_prior(const Model& previous, const Model& incoming) {
  const ErrorStatistics &ours = previous.refinement.prior, &theirs = incoming.refinement.prior;
  if (ours.empty() || theirs.empty()) return ours.empty() ? theirs : ours;
  if (!std::ranges::equal(pack(ours), pack(theirs)))
    throw invalid_argument(
        "fuse: the models began with different priors; learn one of them anew from a copy of the other's prior");
  return ours;
}

/// The episode of an update; run_episode adds the rest of the report.
Episode episode_of(Model model, const LearnReport& learnt, ModelChange change, const PruneReport& pruned = {}) {
  Episode episode{std::move(model), {}};
  episode.report.learn = learnt;
  episode.report.prune = pruned;
  episode.report.change = std::move(change);
  return episode;
}

}  // namespace

std::vector<SiteErrors> errors_by_site(const Model& model) {
  std::vector<SiteErrors> errors;
  for (std::size_t i = 0; i < model.sites.size(); ++i)
    errors.push_back({model.sites[i].frame, entry_of(model.refinement.error_statistics, i)});
  return errors;
}

void set_error_statistics(Model& model, const std::vector<SiteErrors>& past, const std::vector<SiteErrors>& recent,
                          double memory_windows) {
  const auto by_site = [&](const std::vector<SiteErrors>& errors) {
    std::vector<ErrorStatistics> sums(model.sites.size());
    for (const auto& [frame, statistics] : errors) {  // two frames that were apart may both be near one site
      const std::optional<int> site = find_site(model.sites, frame);
      if (!site) continue;
      ErrorStatistics& sum = sums[static_cast<std::size_t>(*site)];
      sum = add_error_statistics(sum, statistics);
    }
    return sums;
  };
  std::vector<ErrorStatistics> updated = by_site(past);
  const std::vector<ErrorStatistics> more = by_site(recent);
  for (std::size_t site = 0; site < updated.size(); ++site)
    updated[site] = add_error_statistics(updated[site], more[site], memory_windows);
  require_one_shape(updated);
  model.refinement.error_statistics = std::move(updated);
}

Update sila_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);                   // M'(n)
    FuseResult fused = fuse(previous, incoming.increment, config.fuse, config.residual);  // M(n)
    ModelChange change = change_by(fused.plan, previous, fused.model);
    PruneResult pruned = prune(std::move(fused.model), config.prune, config.fuse, config.residual);
    change = without_dropped(std::move(change), pruned.kept);
    return episode_of(std::move(pruned.model), incoming.report, std::move(change), pruned.report);
  };
}

Update accumulate_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);
    FuseResult sum = accumulate(previous, incoming.increment, config.residual);
    ModelChange change = change_by(sum.plan, previous, sum.model);
    return episode_of(std::move(sum.model), incoming.report, std::move(change));
  };
}

Update retrain_update(const EpisodeConfig& config) {
  auto seen = std::make_shared<Batch>();
  return [config, seen](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    seen->tracks.insert(seen->tracks.end(), batch.tracks.begin(), batch.tracks.end());
    seen->residuals.insert(seen->residuals.end(), batch.residuals.begin(), batch.residuals.end());
    seen->residual_settings = batch.residual_settings;
    LearnResult learnt = increment_of(*seen, settings, config);
    learnt.increment.model.episodes = previous.episodes + 1;
    ModelChange change = change_by_retraining(previous, learnt.increment.model);
    return episode_of(std::move(learnt.increment.model), learnt.report, std::move(change));
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
  const Batch in_curb_frame = prepared(batch, previous, config);
  Episode episode = (update ? update : sila_update(config))(previous, in_curb_frame, settings);
  set_error_statistics(episode.model, errors_by_site(previous), recent.sites, config.error_statistics.memory_windows);
  episode.model.sharing = config.fuse.sites;
  episode.model.refinement.residual_settings = in_curb_frame.residual_settings;
  episode.model.refinement.prior = previous.refinement.prior;
  BudgetResult within = apply_budget(std::move(episode.model), config.budget);
  within.model.episode_ids = union_of(previous.episode_ids, {id});
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
    throw invalid_argument("fuse: previous began with a sidewalk width of ", ours_m, " m, incoming with ", theirs_m,
                           " m; models that are to be fused must begin with one reference_width_m");
  }
  FuseResult fused = fuse(previous, {incoming, {}}, config, residual);
  set_error_statistics(fused.model, errors_by_site(previous), errors_by_site(incoming),
                       std::numeric_limits<double>::infinity());
  fused.model.refinement.prior = common_prior(previous, incoming);
  fused.model.episode_ids = union_of(previous.episode_ids, incoming.episode_ids);
  return fused;
}

Training run_batches(Model start, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                     const EpisodeObserver& observer) {
  Training result;
  std::optional<Model> model(std::move(start));  // none: it is in the snapshot
  std::unique_ptr<Snapshot> snapshot;
  for (std::span<const FramedTrajectory> batch = next_batch(); !batch.empty(); batch = next_batch()) {
    const auto started = std::chrono::steady_clock::now();
    if (model && config.error_statistics.enabled && model->episodes > 0) {  // error statistics need its predictor
      Model present = *std::exchange(model, std::nullopt);
      snapshot = std::make_unique<Snapshot>(std::move(present), config.predict, snapshot.get());
    }
    const std::chrono::duration<double> snapshot_time = std::chrono::steady_clock::now() - started;
    Episode episode = model ? run_episode(*model, batch, config, update)
                            : run_episode(snapshot->model, batch, config, update, &snapshot->predictor);
    episode.report.seconds += snapshot_time.count();
    if (episode.report.known) {
      ++result.known;
      continue;
    }
    result.episodes.push_back(episode.report);
    if (observer) observer(static_cast<int>(result.episodes.size()), model ? *model : snapshot->model, episode);
    model = std::move(episode.model);
  }
  result.model = std::move(model ? *model : snapshot->model);
  return result;
}

Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer) {
  if (batch_size == 0) throw invalid_argument("run_episodes: batch_size = 0, must be at least 1");
  const auto next_batch = [&, left = tracks]() mutable {
    const auto batch = left.first(std::min(batch_size, left.size()));
    left = left.subspan(batch.size());
    return batch;
  };
  return run_batches(start, next_batch, config, update, observer);
}

}  // namespace sila
