#include "sila/episode/episode.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "sila/core/steps.hpp"
#include "sila/fuse/fade.hpp"

namespace sila {
namespace {

/// The moments of one track that teach outlooks.
std::vector<OutlookExample> examples_of(const PlacedTrack& track, const Conventions& conventions,
                                        const EpisodeConfig& config) {
  std::vector<OutlookExample> examples;
  for (const Window& window :
       windows_of(std::span(&track, 1), config.sampling, config.predict, config.outlook.every_s)) {
    auto example = outlook_example(window.observed, window.future_m, conventions, config.outlook.min_seen_share);
    if (example) examples.push_back(*std::move(example));
  }
  return examples;
}

/// The tracks as they are learnt from.
Batch prepared(std::span<const PlacedTrack> tracks, const Conventions& conventions, const EpisodeConfig& config) {
  Batch batch;
  for (const PlacedTrack& placed : tracks) {
    batch.tracks.push_back(resample(placed.track, placed.frame, config.sampling));
    if (config.outlook.enabled) batch.outlooks.push_back(examples_of(placed, conventions, config));
  }
  return batch;
}

/// What the model's errors on tracks that it has not learnt yet teach.
Lessons taught_by(const Model& previous, std::span<const PlacedTrack> batch, const EpisodeConfig& config,
                  const Predictor* ready) {
  if (!config.lessons.enabled) return previous.lessons;
  return add_lessons(previous.lessons, lessons_on(previous, batch, config, ready), config.lessons.decay);
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

Conventions conventions_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config) {
  const double width_m = config.reference_width_m > 0.0 ? config.reference_width_m : frame.sidewalk_width_m;
  const Conventions fresh =
      with_outlooks(begin_conventions(width_m, config.scaling, config.sampling.interval_s, config.learn.grid),
                    config.predict.horizon_s, config.outlook);
  if (previous.episodes == 0) return fresh;
  const Conventions& kept = previous.conventions;
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
  if (fresh.outlook_horizon_s != kept.outlook_horizon_s || fresh.outlook_knots != kept.outlook_knots) {
    throw std::invalid_argument(
        "run_episode: outlooks with " + std::to_string(fresh.outlook_knots) + " knots until " +
        std::to_string(fresh.outlook_horizon_s) + " s, the model began with " + std::to_string(kept.outlook_knots) +
        " until " + std::to_string(kept.outlook_horizon_s) + " s; keep outlook and predict.horizon_s as they were");
  }
  return kept;
}

Update sila_update(const EpisodeConfig& config) {
  auto settled = std::make_shared<Settled>();
  return [config, settled](const Model& previous, const Batch& batch, const Conventions& conventions) {
    const Learnt incoming = learn(batch, conventions, config.learn, config.outlook);  // M'(n)
    Fused fused = fuse(previous, incoming.increment, config.fuse, config.outlook);    // M(n)
    ModelChange change = change_by(fused.plan, previous, fused.model);
    Compacted small = compact(std::move(fused.model), config.compact, config.fuse, config.outlook, *settled);
    *settled = std::move(small.settled);
    change = without_dropped(std::move(change), small.kept);
    return Updated{std::move(small.model), incoming.report, fused.report, small.report, std::move(change)};
  };
}

Update accumulate_update(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const Conventions& conventions) {
    const Learnt incoming = learn(batch, conventions, config.learn, config.outlook);
    Fused sum = accumulate(previous, incoming.increment);
    ModelChange change = change_by(sum.plan, previous, sum.model);
    return Updated{std::move(sum.model), incoming.report, sum.report, {}, std::move(change)};
  };
}

Update relearn_update(const EpisodeConfig& config) {
  auto seen = std::make_shared<Batch>();
  return [config, seen](const Model& previous, const Batch& batch, const Conventions& conventions) {
    seen->tracks.insert(seen->tracks.end(), batch.tracks.begin(), batch.tracks.end());
    seen->outlooks.insert(seen->outlooks.end(), batch.outlooks.begin(), batch.outlooks.end());
    Learnt learnt = learn(*seen, conventions, config.learn, config.outlook);
    learnt.increment.model.episodes = previous.episodes + 1;
    ModelChange change = change_by_relearning(previous, learnt.increment.model);
    return Updated{std::move(learnt.increment.model), learnt.report, {}, {}, std::move(change)};
  };
}

std::vector<Window> windows_of(std::span<const PlacedTrack> tracks, const SamplingConfig& sampling,
                               const PredictConfig& predict, double every_s) {
  const auto steps = static_cast<std::size_t>(steps_in(predict.horizon_s, sampling.interval_s));
  std::vector<Window> windows;
  for (const PlacedTrack& placed : tracks) {
    for (std::size_t last : prediction_samples(placed.track, predict.observe_s, every_s)) {
      windows.push_back({observe(placed.track, last, placed.frame, predict.observe_s, sampling),
                         future(placed.track, last, steps, sampling)});
    }
  }
  return windows;
}

Lessons lessons_on(const Model& model, std::span<const PlacedTrack> unseen, const EpisodeConfig& config,
                   const Predictor* ready) {
  if (unseen.empty()) return {};
  const Conventions conventions = conventions_for(model, unseen.front().frame, config);
  const std::vector<Window> windows = windows_of(unseen, config.sampling, config.predict, config.lessons.every_s);
  if (ready && conventions == model.conventions) return gather_lessons(*ready, windows);
  Model seen = model;
  seen.conventions = conventions;
  return gather_lessons(Predictor(seen, config.predict), windows);
}

namespace {

/// One episode without the fading that comes before it.
Episode take_up(const Model& previous, std::span<const PlacedTrack> batch, const EpisodeConfig& config,
                const Update& update, const Predictor* ready) {
  validate_fields("run_episode", config);
  if (batch.empty()) return {previous, {}};
  const auto start = std::chrono::steady_clock::now();
  const Conventions conventions = conventions_for(previous, batch.front().frame, config);
  const EpisodeId id = episode_id(batch);
  if (std::ranges::binary_search(previous.episode_ids, id)) {
    Episode known{previous, {}};
    known.report.known = true;
    known.report.size_before = known.report.size_after = size(previous);
    return known;
  }
  Lessons lessons = taught_by(previous, batch, config, ready);
  Updated updated = update(previous, prepared(batch, conventions, config), conventions);
  updated.model.lessons = std::move(lessons);
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

Episode run_episode(const Model& previous, std::span<const PlacedTrack> batch, const EpisodeConfig& config,
                    const Update& update, const Predictor* ready) {
  const double half_life = config.compact.half_life_episodes;
  if (std::isinf(half_life) || batch.empty()) return take_up(previous, batch, config, update, ready);
  validate_fields("run_episode", config);
  Episode episode = take_up(fade(previous, std::exp2(-1.0 / half_life)), batch, config, update, nullptr);
  if (episode.report.known) episode.model = previous;
  return episode;
}

Episode run_episode(const Model& previous, std::span<const PlacedTrack> batch, const EpisodeConfig& config,
                    const Predictor* ready) {
  return run_episode(previous, batch, config, sila_update(config), ready);
}

Fused fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
                  const OutlookConfig& outlook) {
  require_nothing_shared(previous, incoming);
  const double ours_m = previous.conventions.reference_width_m, theirs_m = incoming.conventions.reference_width_m;
  if (previous.episodes > 0 && incoming.episodes > 0 && ours_m != theirs_m) {
    throw std::invalid_argument("fuse_models: previous began with a sidewalk width of " + std::to_string(ours_m) +
                                " m, incoming with " + std::to_string(theirs_m) +
                                " m; models that are to be fused must begin with one reference_width_m");
  }
  Fused fused = fuse(previous, {incoming, {}}, config, outlook);
  fused.model.episode_ids = joined(previous.episode_ids, incoming.episode_ids);
  fused.model.lessons = add_lessons(previous.lessons, incoming.lessons, 1.0);
  return fused;
}

}  // namespace sila
