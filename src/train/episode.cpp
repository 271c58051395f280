#include "sila/train/episode.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "sila/core/steps.hpp"
#include "sila/refine/fade.hpp"

namespace sila {
namespace {

/// The moments of one track that teach residual GPs.
std::vector<ResidualSample> examples_of(const FramedTrajectory& track, const ModelSettings& settings,
                                        const EpisodeConfig& config) {
  std::vector<ResidualSample> examples;
  for (const Window& window :
       windows_of(std::span(&track, 1), config.sampling, config.predict, config.residual.every_s)) {
    auto example = residual_sample(window.observed, window.future_m, settings, config.residual.min_seen_share);
    if (example) examples.push_back(*std::move(example));
  }
  return examples;
}

/// The tracks as they are learnt from.
Batch prepared(std::span<const FramedTrajectory> tracks, const ModelSettings& settings, const EpisodeConfig& config) {
  Batch batch;
  for (const FramedTrajectory& placed : tracks) {
    batch.tracks.push_back(resample(placed.track, placed.frame, config.sampling));
    if (config.residual.enabled) batch.residuals.push_back(examples_of(placed, settings, config));
  }
  return batch;
}

/// Gives each site what its own past errors show and what `recent` ones teach; a site without recent ones stays as it
/// was.
void set_error_statistics(std::vector<Site>& sites, const std::vector<Site>& previous, const std::vector<Site>& recent,
                          double memory_windows) {
  const auto error_statistics_in = [](const std::vector<Site>& of, const CurbFrame& frame) {
    const auto site = find_site(of, frame);
    return site ? of[static_cast<std::size_t>(*site)].error_statistics : ErrorStatistics{};
  };
  for (Site& site : sites) {
    site.error_statistics =
        add_error_statistics(error_statistics_in(previous, site.frame), error_statistics_in(recent, site.frame), memory_windows);
  }
  require_one_shape(sites);
}

/// The sites of a model that a batch shows.
std::vector<int> sites_in(const Model& model, std::span<const FramedTrajectory> batch) {
  std::set<int> sites;
  for (const FramedTrajectory& track : batch) {
    if (const auto site = find_site(model.sites, track.frame)) sites.insert(*site);
  }
  return {sites.begin(), sites.end()};
}

/// M'(n): each site by itself, or all in one.
Learnt increment_of(const Batch& batch, const ModelSettings& settings, const EpisodeConfig& config) {
  if (config.fuse.sites == SiteSharing::apart) return learn_apart(batch, settings, config.learn, config.residual);
  return learn(batch, settings, config.learn, config.residual);
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
  throw std::invalid_argument("fuse_models: incoming shares " + std::to_string(shared.size()) +
                              " episodes with previous (" + to_text(shared.front()) +
                              " is one), which would count twice; learn the others anew without them");
}

}  // namespace

ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config) {
  const bool metres = config.scaling == CurbScaling::metres;
  if (metres && config.reference_width_m > 0.0) {
    throw std::invalid_argument("run_episode: reference_width_m = " + std::to_string(config.reference_width_m) +
                                " has no meaning with scaling = metres; leave it 0, or choose scaling = mean_width");
  }
  if (metres && frame.unit_m != Vector2::Ones()) {
    throw std::invalid_argument("run_episode: frame.unit_m = " + std::to_string(frame.unit_m.x()) +
                                ", with scaling = metres it must be 1; make the frame with that scaling");
  }
  require_separable("run_episode", previous, config.fuse.sites);
  const double width_m = config.reference_width_m > 0.0 ? config.reference_width_m : frame.sidewalk_width_m;
  const ModelSettings fresh = with_residuals(
      begin_settings(metres ? 1.0 : width_m, config.scaling, config.sampling.interval_s, config.learn.grid),
      config.predict.horizon_s, config.residual);
  if (previous.episodes == 0) return fresh;
  const ModelSettings& kept = previous.settings;
  if (fresh.scaling != kept.scaling)
    throw std::invalid_argument("run_episode: scaling is not the one that the model began with");
  if (fresh.sample_interval_s != kept.sample_interval_s) {
    throw std::invalid_argument("run_episode: sampling.interval_s = " + std::to_string(fresh.sample_interval_s) +
                                ", the model began with " + std::to_string(kept.sample_interval_s));
  }
  if (config.reference_width_m > 0.0 && config.reference_width_m != kept.reference_width_m) {
    throw std::invalid_argument("run_episode: reference_width_m = " + std::to_string(config.reference_width_m) +
                                ", the model began with " + std::to_string(kept.reference_width_m));
  }
  const double kept_cell_m = kept.grid.cell * kept.reference_width_m;
  if (std::abs(config.learn.grid.cell_m - kept_cell_m) > 1e-9 * kept_cell_m ||
      config.learn.grid.tile_cells != kept.grid.tile_cells) {
    throw std::invalid_argument(
        "run_episode: learn.grid is not the grid that the model began with (cell_m = " + std::to_string(kept_cell_m) +
        ", tile_cells = " + std::to_string(kept.grid.tile_cells) + ")");
  }
  if (fresh.residual_horizon_s != kept.residual_horizon_s || fresh.residual_knots != kept.residual_knots) {
    throw std::invalid_argument(
        "run_episode: residual GPs with " + std::to_string(fresh.residual_knots) + " knots until " +
        std::to_string(fresh.residual_horizon_s) + " s, the model began with " + std::to_string(kept.residual_knots) +
        " until " + std::to_string(kept.residual_horizon_s) + " s; keep residual.* and predict.horizon_s as they were");
  }
  return kept;
}

Update sila_update(const EpisodeConfig& config) {
  auto settled = std::make_shared<Settled>();
  return [config, settled](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const Learnt incoming = increment_of(batch, settings, config);                   // M'(n)
    Fused fused = fuse(previous, incoming.increment, config.fuse, config.residual);  // M(n)
    ModelChange change = change_by(fused.plan, previous, fused.model);
    Compacted small = compact(std::move(fused.model), config.compact, config.fuse, config.residual, *settled);
    *settled = std::move(small.settled);
    change = without_dropped(std::move(change), small.kept);
    return Updated{std::move(small.model), incoming.report, fused.report, small.report, std::move(change)};
  };
}

Update accumulate_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const Learnt incoming = increment_of(batch, settings, config);
    Fused sum = accumulate(previous, incoming.increment, config.residual);
    ModelChange change = change_by(sum.plan, previous, sum.model);
    return Updated{std::move(sum.model), incoming.report, sum.report, {}, std::move(change)};
  };
}

Update retrain_update(const EpisodeConfig& config) {
  auto seen = std::make_shared<Batch>();
  return [config, seen](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    seen->tracks.insert(seen->tracks.end(), batch.tracks.begin(), batch.tracks.end());
    seen->residuals.insert(seen->residuals.end(), batch.residuals.begin(), batch.residuals.end());
    Learnt learnt = increment_of(*seen, settings, config);
    learnt.increment.model.episodes = previous.episodes + 1;
    ModelChange change = change_by_retraining(previous, learnt.increment.model);
    return Updated{std::move(learnt.increment.model), learnt.report, {}, {}, std::move(change)};
  };
}

std::vector<Window> windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const PredictConfig& predict, double every_s) {
  const auto steps = static_cast<std::size_t>(steps_in(predict.horizon_s, sampling.interval_s));
  std::vector<Window> windows;
  for (const FramedTrajectory& placed : tracks) {
    for (std::size_t last : prediction_samples(placed.track, predict.observe_s, every_s)) {
      windows.push_back({observe(placed.track, last, placed.frame, predict.observe_s, sampling),
                         past(placed.track, last, predict.observe_s, sampling),
                         future(placed.track, last, steps, sampling)});
    }
  }
  return windows;
}

std::vector<Site> error_statistics_on(const Model& model, std::span<const FramedTrajectory> unseen,
                                      const EpisodeConfig& config, const Predictor* ready) {
  if (unseen.empty()) return {};
  const ModelSettings settings = settings_for(model, unseen.front().frame, config);
  std::optional<Predictor> made;
  if (!ready || !(settings == model.settings)) {
    Model seen = model;
    seen.settings = settings;
    ready = &made.emplace(seen, config.predict);
  }
  std::vector<Site> sites;
  std::vector<std::vector<FramedTrajectory>> tracks;
  for (const FramedTrajectory& track : unseen) {
    const auto site = static_cast<std::size_t>(find_or_add_site(sites, track.frame));
    tracks.resize(sites.size());
    tracks[site].push_back(track);
  }
  for (std::size_t i = 0; i < sites.size(); ++i) {
    sites[i].error_statistics = gather_error_statistics(
        *ready, windows_of(tracks[i], config.sampling, config.predict, config.error_statistics.every_s));
  }
  return sites;
}

namespace {

/// One episode without the fading that comes before it.
Episode take_up(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                const Update& update, const Predictor* ready) {
  validate_fields("run_episode", config);
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
  std::vector<Site> recent;
  if (config.error_statistics.enabled) recent = error_statistics_on(previous, batch, config, ready);
  Updated updated = update(previous, prepared(batch, settings, config), settings);
  set_error_statistics(updated.model.sites, previous.sites, recent, config.error_statistics.memory_windows);
  updated.model.sharing = config.fuse.sites;
  Limited limited = limit(std::move(updated.model), config.model, config.compact);
  updated.model = std::move(limited.model);
  updated.change = without_dropped(std::move(updated.change), limited.kept);
  updated.model.episode_ids = joined(previous.episode_ids, {id});
  Episode episode{std::move(updated.model), {}};
  episode.report.tracks = static_cast<int>(batch.size());
  episode.report.size_before = size(previous);
  episode.report.size_after = size(episode.model);
  episode.report.learn = updated.learn;
  episode.report.fuse = std::move(updated.fuse);
  episode.report.compact = updated.compact;
  episode.report.given_up = limited.report;
  episode.report.change = std::move(updated.change);
  episode.report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return episode;
}

}  // namespace

Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update, const Predictor* ready) {
  const double half_life = config.compact.half_life_episodes;
  if (std::isinf(half_life) || batch.empty()) return take_up(previous, batch, config, update, ready);
  validate_fields("run_episode", config);
  const Model faded = fade(previous, std::exp2(-1.0 / half_life), sites_in(previous, batch));
  Episode episode = take_up(faded, batch, config, update, nullptr);
  if (episode.report.known) episode.model = previous;
  return episode;
}

Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Predictor* ready) {
  return run_episode(previous, batch, config, sila_update(config), ready);
}

Fused fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
                  const ResidualConfig& residual) {
  require_nothing_shared(previous, incoming);
  const double ours_m = previous.settings.reference_width_m, theirs_m = incoming.settings.reference_width_m;
  const bool by_width =
      previous.settings.scaling != CurbScaling::metres && previous.settings.scaling == incoming.settings.scaling;
  if (by_width && previous.episodes > 0 && incoming.episodes > 0 && ours_m != theirs_m) {
    throw std::invalid_argument("fuse_models: previous began with a sidewalk width of " + std::to_string(ours_m) +
                                " m, incoming with " + std::to_string(theirs_m) +
                                " m; models that are to be fused must begin with one reference_width_m");
  }
  Fused fused = fuse(previous, {incoming, {}}, config, residual);
  fused.model.episode_ids = joined(previous.episode_ids, incoming.episode_ids);
  return fused;
}

}  // namespace sila
