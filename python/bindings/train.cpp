#include "bindings.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/reports.hpp"
#include "sila/train/episode.hpp"

namespace sila::python {
namespace {

/// Learns tracks, `batch` an episode. `on_episode(done, of, tracks, size)` is called after each one; it and Ctrl-C
/// may end the run by an exception. Returns the model, and warnings.
std::pair<StoredModel, std::vector<std::string>> learn_tracks(const StoredModel& start,
                                                              const std::vector<Track>& tracks, const DrawnScene& scene,
                                                              const std::string& config_json, std::size_t batch,
                                                              int threads, const nb::callable& on_episode) {
  const nb::gil_scoped_release release;
  const ThreadLimit limit(threads);
  const Config config = config_of(config_json);
  const std::vector<FramedTrajectory> input = placed(tracks, scene, config);
  std::vector<std::string> warnings =
      warnings_before_learning(start, std::span(input).first(std::min(batch, input.size())), input);
  StoredModel result = start;
  result.configuration = to_json(config).dump();
  const auto episodes = batch == 0 ? 0 : (input.size() + batch - 1) / batch;
  const auto observe = [&](int number, const Model& previous, const Episode& episode) {
    result.episodes.push_back(record_of(last_episode(start) + number, previous, episode));
    const nb::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    on_episode(number, episodes, episode.report.tracks, episode.report.size_after);
  };
  result.model = run_episodes(start.model, input, batch, config.episode, sila_update(config.episode), observe).model;
  return {std::move(result), std::move(warnings)};
}

StoredModel learn_all(const std::vector<Track>& tracks, const DrawnScene& scene, const std::string& config_json,
                      int threads) {
  const ThreadLimit limit(threads);
  const Config config = config_of(config_json);
  EpisodeConfig whole = config.episode;
  whole.prune.enabled = false;
  const std::vector<FramedTrajectory> input = placed(tracks, scene, config);
  const Training run = run_episodes({}, input, input.size(), whole, sila_update(whole));
  StoredModel result;
  result.model = run.model;
  result.configuration = to_json(config).dump();
  for (const EpisodeReport& report : run.episodes) result.episodes.push_back(record_of(1, {}, {run.model, report}));
  return result;
}

StoredModel fuse_stored(const StoredModel& previous, const StoredModel& incoming, const std::string& config_json,
                        int threads) {
  const ThreadLimit limit(threads);
  const Config config = config_of(config_json);
  require_fitting(previous.model, config.episode);
  require_one_scale(config, config_of(incoming.configuration));
  StoredModel result;
  result.model = fuse_models(previous.model, incoming.model, config.episode.fuse, config.episode.residual).model;
  result.configuration = to_json(config).dump();
  result.episodes = joined(previous.episodes, incoming.episodes);
  return result;
}

std::string explain(const StoredModel& previous, const StoredModel& incoming, const std::string& config_json) {
  const Config config = config_of(config_json);
  const FuseResult fused = fuse_models(previous.model, incoming.model, config.episode.fuse);
  return explain_fusion("previous + incoming", fused.problem, config.episode.fuse, fused.plan).dump();
}

/// The tracks to learn from, and those held back.
std::pair<std::vector<Track>, std::vector<Track>> split(const std::vector<Track>& tracks, double test_share,
                                                        std::uint64_t seed, const std::string& by) {
  std::map<std::string, std::string> input_ids;
  for (const Track& track : tracks) input_ids[track.trajectory.id] = track.input_id;
  const auto as_tracks = [&](std::vector<FramedTrajectory> side) {
    std::vector<Track> result;
    for (FramedTrajectory& entry : side) {
      std::string input_id = input_ids[entry.track.id];
      result.push_back({std::move(entry.track), std::move(input_id)});
    }
    return result;
  };
  const auto split_by = value_named<SplitBy>("split_tracks: by", kSplitBy, by);
  Split parts = split_tracks(without_frames(list_of(tracks, &Track::trajectory)), test_share, seed, split_by);
  return {as_tracks(std::move(parts.train)), as_tracks(std::move(parts.test))};
}

}  // namespace

void bind_episode(nb::module_& module) {
  module.def("learn", &learn_tracks, "start"_a, "tracks"_a, "scene"_a, "config"_a, "batch"_a, "threads"_a,
             "on_episode"_a);
  module.def("train_batch", &learn_all, "tracks"_a, "scene"_a, "config"_a, "threads"_a,
             nb::call_guard<nb::gil_scoped_release>());
  module.def(
      "require_same_units",
      [](const StoredModel& stored, const std::string& config) { require_same_units(stored, config_of(config)); },
      "model"_a, "config"_a);
  module.def("fuse", &fuse_stored, "previous"_a, "incoming"_a, "config"_a, "threads"_a,
             nb::call_guard<nb::gil_scoped_release>());
  module.def(
      "warning_of_own_frames",
      [](const StoredModel& previous, const StoredModel& incoming, const StoredModel& fused) {
        return warning_of_own_frames(previous.model, incoming.model, fused.model);
      },
      "previous"_a, "incoming"_a, "fused"_a);
  module.def(
      "make_prior", [](const std::vector<StoredModel>& models) { return stored_prior(models); }, "models"_a,
      nb::call_guard<nb::gil_scoped_release>());
  module.def(
      "simulated_prior", [](const std::string& config) { return simulated_prior(config_of(config)); }, "config"_a,
      nb::call_guard<nb::gil_scoped_release>());
  module.def("explain_fusion", &explain, "previous"_a, "incoming"_a, "config"_a,
             nb::call_guard<nb::gil_scoped_release>());
  module.def("split_tracks", &split, "tracks"_a, "test_share"_a, "seed"_a, "by"_a,
             nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace sila::python
