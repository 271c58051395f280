#include "sila/train/episode.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "refine/error_statistics.hpp"
#include "refine/refine.hpp"
#include "refine/residual.hpp"
#include "sila/core/counted.hpp"
#include "sila/core/sampling.hpp"
#include "sila/model/packing.hpp"
#include "train/change.hpp"

namespace sila {
namespace {

/// The samples of one track for residual GPs.
std::vector<ResidualSample> samples_of(const FramedTrajectory& track, const ModelSettings& settings,
                                       const EpisodeConfig& config) {
  std::vector<ResidualSample> examples;
  for (const Window& window :
       windows_of(std::span(&track, 1), config.sampling, config.predict, config.residual.stride_s)) {
    auto example = residual_sample(window.observed, window.future_m, settings, config.residual.min_seen_share);
    if (example) examples.push_back(*std::move(example));
  }
  return examples;
}

/// The tracks in curb coordinates and their samples for residual GPs.
Batch prepared(std::span<const FramedTrajectory> tracks, const ModelSettings& settings, const EpisodeConfig& config) {
  Batch batch;
  for (const FramedTrajectory& placed : tracks) {
    batch.tracks.push_back(resample(placed.track, placed.frame, config.sampling));
    if (config.residual.enabled) batch.residuals.push_back(samples_of(placed, settings, config));
  }
  return batch;
}

/// Merges the `recent` error statistics into those of each site; a site without recent ones does not change.
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

/// M'(n): each site by itself, or all in one.
LearnResult increment_of(const Batch& batch, const ModelSettings& settings, const EpisodeConfig& config) {
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
  throw std::invalid_argument("fuse_models: incoming shares " + counted(shared.size(), "episode") + " with previous (" +
                              to_text(shared.front()) +
                              " is one), which would count twice; learn the others anew without them");
}

/// Of two models, of which one may have been trained without.
const ErrorStatistics& common_prior(const Model& previous, const Model& incoming) {
  if (previous.prior.empty() || incoming.prior.empty()) return previous.prior.empty() ? incoming.prior : previous.prior;
  if (!std::ranges::equal(pack(previous.prior), pack(incoming.prior)))
    throw std::invalid_argument("fuse_models: previous and incoming have different priors");
  return previous.prior;
}

}  // namespace

ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config) {
  validate(config);
  const bool metres = config.scaling == CurbScaling::metres;
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
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);                   // M'(n)
    FuseResult fused = fuse(previous, incoming.increment, config.fuse, config.residual);  // M(n)
    ModelChange change = change_by(fused.plan, previous, fused.model);
    PruneResult pruned = prune(std::move(fused.model), config.prune, config.fuse, config.residual);
    change = without_dropped(std::move(change), pruned.kept);
    return UpdateResult{std::move(pruned.model), incoming.report, fused.report, pruned.report, std::move(change)};
  };
}

Update accumulate_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = increment_of(batch, settings, config);
    FuseResult sum = accumulate(previous, incoming.increment, config.residual);
    ModelChange change = change_by(sum.plan, previous, sum.model);
    return UpdateResult{std::move(sum.model), incoming.report, sum.report, {}, std::move(change)};
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
    return UpdateResult{std::move(learnt.increment.model), learnt.report, {}, {}, std::move(change)};
  };
}

namespace {

/// The end of a track until sample `last`, as if the person had appeared `seconds` before.
Trajectory appeared(const Trajectory& track, std::size_t last, double seconds) {
  constexpr double slack_s = 1e-6;
  const auto begin = track.times_s.begin();
  const auto later =
      std::upper_bound(begin, begin + static_cast<std::ptrdiff_t>(last), track.times_s[last] - seconds + slack_s);
  const auto from = std::max<std::ptrdiff_t>(1, later - begin) - 1, end = static_cast<std::ptrdiff_t>(last) + 1;
  Trajectory recent{track.id, {begin + from, begin + end}, {}, track.recording};
  recent.positions_m.assign(track.positions_m.begin() + from, track.positions_m.begin() + end);
  return recent;
}

/// `observed_s` below `predict.observe_s`: as if the person had appeared so long before.
Window window_at(const FramedTrajectory& placed, std::size_t last, double observed_s, const PresentPeople& present,
                 const SamplingConfig& sampling, const RefineConfig& predict) {
  std::vector<Vector2> future_m =
      future(placed.track, last, static_cast<std::size_t>(steps_in(predict.horizon_s, sampling.interval_s)), sampling);
  const bool whole = observed_s >= predict.observe_s;
  const Trajectory recent = whole ? placed.track : appeared(placed.track, last, observed_s);
  const std::size_t end = whole ? last : recent.times_s.size() - 1;
  const double reach_s = whole ? predict.observe_s : std::min(observed_s + sampling.interval_s, predict.observe_s);
  return {present.observe(recent, end, placed.frame, reach_s, sampling), past(recent, end, reach_s, sampling),
          std::move(future_m)};
}

}  // namespace

std::vector<Window> windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const RefineConfig& predict, double stride_s, std::span<const double> observed_s,
                               const PresentPeople* present) {
  if (present == nullptr) {
    const PresentPeople own(tracks);
    return windows_of(tracks, sampling, predict, stride_s, observed_s, &own);
  }
  std::vector<Window> windows;
  for (const FramedTrajectory& placed : tracks) {
    for (std::size_t last : prediction_samples(placed.track, predict.observe_s, stride_s)) {
      const double seconds = observed_s.empty() ? predict.observe_s : observed_s[windows.size() % observed_s.size()];
      windows.push_back(window_at(placed, last, seconds, *present, sampling, predict));
    }
  }
  return windows;
}

namespace {

/// The tracks of each site, in the order in which the sites first come.
std::vector<std::vector<FramedTrajectory>> tracks_by_site(std::span<const FramedTrajectory> tracks) {
  std::vector<Site> sites;
  std::vector<std::vector<FramedTrajectory>> groups;
  for (const FramedTrajectory& track : tracks) {
    const auto site = static_cast<std::size_t>(find_or_add_site(sites, track.frame));
    groups.resize(sites.size());
    groups[site].push_back(track);
  }
  return groups;
}

/// The prequential errors of a batch.
struct BatchErrors {
  std::vector<Site> sites;  ///< with error statistics
  PrequentialError path;    ///< at all sites that the model knew
};

/// `unseen`: by site.
BatchErrors errors_by(const Predictor& predictor, std::span<const std::vector<FramedTrajectory>> unseen,
                      const EpisodeConfig& config) {
  // Every other moment once more, as of people who appeared shortly before.
  std::vector<double> shorter_s;
  std::ranges::copy_if(kShorterObserved_s, std::back_inserter(shorter_s),
                       [&](double seconds) { return seconds < config.predict.observe_s; });
  BatchErrors errors;
  for (const std::vector<FramedTrajectory>& tracks : unseen) {
    const PresentPeople present(tracks);
    const auto windows = [&](double stride_s, std::span<const double> observed_s) {
      return windows_of(tracks, config.sampling, config.predict, stride_s, observed_s, &present);
    };
    std::vector<Window> all = windows(config.error_statistics.stride_s, {});
    if (!shorter_s.empty())
      std::ranges::move(windows(2.0 * config.error_statistics.stride_s, shorter_s), std::back_inserter(all));
    GatheredErrors gathered = gather_errors(predictor, all);
    errors.sites.push_back({tracks.front().frame, 0, 0, std::move(gathered.statistics)});
    errors.path += gathered.path;
  }
  return errors;
}

/// The reports of an update and of the budget, and the sizes.
EpisodeReport report_of(std::size_t tracks, std::size_t size_before, const Model& model, UpdateResult& updated,
                        const BudgetReport& budget) {
  EpisodeReport report;
  report.tracks = static_cast<int>(tracks);
  report.size_before = size_before;
  report.size_after = size(model);
  report.learn = updated.learn;
  report.fuse = std::move(updated.fuse);
  report.prune = updated.prune;
  report.budget = budget;
  report.change = std::move(updated.change);
  return report;
}

/// The first batch of a site has no model that could predict it. It is split into this number of parts; a model of the
/// earlier parts predicts each, and the errors are the error statistics of the site.
constexpr std::size_t kFirstParts = 4;
constexpr std::size_t kLeastPartTracks = 2;

ErrorStatistics first_statistics(std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                                 const ErrorStatistics& prior) {
  Model model;
  model.prior = prior;
  if (batch.size() < kFirstParts * kLeastPartTracks)
    return error_statistics_on(model, batch, config).front().error_statistics;
  for (std::size_t part = 0; part < kFirstParts; ++part) {
    const std::size_t begin = batch.size() * part / kFirstParts, end = batch.size() * (part + 1) / kFirstParts;
    model = run_episode(model, batch.subspan(begin, end - begin), config).model;
  }
  return std::move(model.sites.front().error_statistics);
}

BatchErrors errors_on(const Model& model, std::span<const std::vector<FramedTrajectory>> unseen,
                      const EpisodeConfig& config) {
  if (unseen.empty()) return {};
  Model seen = model;
  seen.settings = settings_for(model, unseen.front().front().frame, config);
  return errors_by(Predictor(seen, config.predict), unseen, config);
}

/// `predictor`: of `previous`, null if there is none yet.
BatchErrors recent_errors(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                          const Predictor* predictor) {
  std::vector<std::vector<FramedTrajectory>> by_site = tracks_by_site(batch);
  const auto first = std::stable_partition(by_site.begin(), by_site.end(), [&](const auto& tracks) {
    return find_site(previous.sites, tracks.front().frame).has_value();
  });
  const std::span known(by_site.begin(), first);
  BatchErrors recent = predictor ? errors_by(*predictor, known, config) : errors_on(previous, known, config);
  for (const std::vector<FramedTrajectory>& tracks : std::span(first, by_site.end()))
    recent.sites.push_back({tracks.front().frame, 0, 0, first_statistics(tracks, config, previous.prior)});
  return recent;
}

/// `predictor`: of `previous`, null if there is none yet.
Episode run(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
            const Update& update, const Predictor* predictor) {
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
    recent = recent_errors(previous, batch, config, settings == previous.settings ? predictor : nullptr);
  UpdateResult updated = update(previous, prepared(batch, settings, config), settings);
  set_error_statistics(updated.model.sites, previous.sites, recent.sites, config.error_statistics.memory_windows);
  updated.model.sharing = config.fuse.sites;
  updated.model.prior = previous.prior;
  BudgetResult within = apply_budget(std::move(updated.model), config.budget, config.prune);
  updated.change = without_dropped(std::move(updated.change), within.kept);
  within.model.episode_ids = joined(previous.episode_ids, {id});
  EpisodeReport report = report_of(batch.size(), size(previous), within.model, updated, within.report);
  report.prequential = recent.path;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {std::move(within.model), std::move(report)};
}

}  // namespace

std::vector<Site> error_statistics_on(const Model& model, std::span<const FramedTrajectory> unseen,
                                      const EpisodeConfig& config) {
  return errors_on(model, tracks_by_site(unseen), config).sites;
}

Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update) {
  return run(previous, batch, config, update, nullptr);
}

Episode run_episode(const Snapshot& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update) {
  return run(previous.model, batch, config, update, &previous.predictor);
}

Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config) {
  return run_episode(previous, batch, config, sila_update(config));
}

FuseResult fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
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
  FuseResult fused = fuse(previous, {incoming, {}}, config, residual);
  fused.model.prior = common_prior(previous, incoming);
  fused.model.episode_ids = joined(previous.episode_ids, incoming.episode_ids);
  return fused;
}

}  // namespace sila
