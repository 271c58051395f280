#include "sila/train/fleet.hpp"

#include <nanobind/stl/variant.h>

#include <cstring>

#include "bindings.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/model_file.hpp"
#include "sila/model/packing.hpp"

namespace sila::python {
namespace {

using PythonValue = std::variant<std::monostate, StoredModel, SiteErrorStatistics>;
using PythonTask = std::tuple<std::string, int, std::vector<int>>;

std::vector<EpisodeId> ids_in(const std::vector<std::string>& texts) {
  return list_of(texts, episode_id_of);
}

Partition partition_of(const std::vector<Track>& tracks, const DrawnScene& scene, std::size_t batch,
                       const std::vector<std::string>& left_out, const Config& config) {
  return {placed(tracks, scene, config), batch, ids_in(left_out), {}};
}

/// The episodes of a partition and the site of its first track.
std::pair<std::vector<std::string>, FrameState> content_of_tracks(const std::vector<Track>& tracks,
                                                                  const DrawnScene& scene, std::size_t batch,
                                                                  const std::string& config) {
  const Partition partition = partition_of(tracks, scene, batch, {}, config_of(config));
  return {texts_of(episodes_of(partition)), state_of(site_of(partition))};
}

std::pair<std::vector<std::string>, FrameState> content_of_model(const StoredModel& stored) {
  Partition partition;
  partition.model = stored.model;
  return {texts_of(episodes_of(partition)), state_of(site_of(partition))};
}

std::vector<std::pair<std::size_t, std::vector<std::string>>> chosen(
    const std::vector<std::vector<std::string>>& episodes, const std::vector<FrameState>& sites,
    const std::vector<bool>& are_models, const std::vector<std::string>& known) {
  const auto choices =
      choose_partitions(list_of(episodes, ids_in), list_of(sites, frame_in), are_models, ids_in(known));
  return list_of(choices,
                 [](const ChosenPartition& choice) { return std::pair(choice.partition, texts_of(choice.left_out)); });
}

std::vector<PythonTask> plan(int partitions, bool goes_on, const std::string& config) {
  std::vector<PythonTask> tasks;
  for (const FleetTask& task : plan_fleet(partitions, goes_on, config_of(config).episode))
    tasks.emplace_back(kFleetSteps[static_cast<std::size_t>(task.step)], task.partition, task.inputs);
  return tasks;
}

FleetValue without_file(PythonValue value) {
  if (auto* stored = std::get_if<StoredModel>(&value)) return std::move(stored->model);
  if (auto* error_statistics = std::get_if<SiteErrorStatistics>(&value)) return std::move(*error_statistics);
  return {};
}

/// One line for all that a fleet has learnt: its file would grow by each batch otherwise, and the seconds of one run
/// are not those of the next.
StoredModel recorded(Model model, const StoredModel& start, const Config& config) {
  StoredModel stored{std::move(model), to_json(config).dump(), start.episodes, {}, 0};
  const nlohmann::ordered_json statistics{{"fleet_episodes", stored.model.episodes - start.model.episodes}};
  stored.episodes.push_back({last_episode(start) + 1, stored.model.tracks - start.model.tracks, 0.0, size(start.model),
                             size(stored.model), statistics.dump()});
  return stored;
}

PythonValue run(const std::string& step, const Partition& partition, std::vector<PythonValue> inputs,
                const Config& config, int threads) {
  const ThreadLimit limit(threads);
  const FleetStep what = value_named<FleetStep>("run_task: step", kFleetSteps, step);
  const auto* start = inputs.size() == 3 ? std::get_if<StoredModel>(&inputs[2]) : nullptr;
  const StoredModel before = start == nullptr ? StoredModel{} : *start;
  std::vector<FleetValue> values;
  for (PythonValue& input : inputs) values.push_back(without_file(std::move(input)));
  std::vector<const FleetValue*> pointers;
  for (const FleetValue& value : values) pointers.push_back(&value);
  FleetValue result = run_task(what, partition, pointers, config.episode);
  if (auto* error_statistics = std::get_if<SiteErrorStatistics>(&result)) return std::move(*error_statistics);
  Model& model = std::get<Model>(result);
  if (what == FleetStep::finalise) return recorded(std::move(model), before, config);
  return StoredModel{std::move(model), to_json(config).dump(), {}, {}, 0};
}

PythonValue run_on_tracks(const std::string& step, const std::vector<Track>& tracks, const DrawnScene& scene,
                          std::size_t batch, const std::vector<std::string>& left_out, std::vector<PythonValue> inputs,
                          const std::string& config_json, int threads) {
  const Config config = config_of(config_json);
  return run(step, partition_of(tracks, scene, batch, left_out, config), std::move(inputs), config, threads);
}

PythonValue run_on_model(const std::string& step, const std::optional<StoredModel>& model,
                         std::vector<PythonValue> inputs, const std::string& config, int threads) {
  Partition partition;
  if (model) partition.model = model->model;
  return run(step, partition, std::move(inputs), config_of(config), threads);
}

/// Whether a model may be fused with those that learn under this configuration; says what differs.
void require_settings(const StoredModel& stored, const DrawnScene& drawn, const std::string& config_json) {
  const Config config = config_of(config_json);
  require_one_scale(config, config_of(stored.configuration));
  const CurbFrame& frame = drawn.scene.corners.at(drawn.scene.primary).frame;
  (void)settings_for(stored.model, rescaled(frame, config.episode.scaling), config.episode);
}

}  // namespace

void bind_fleet(nb::module_& module) {
  nb::class_<SiteErrorStatistics>(module, "ErrorStatistics", "Error statistics by site; sums of constant size.")
      .def("__getstate__",
           [](const SiteErrorStatistics& error_statistics) {
             std::vector<std::tuple<FrameState, nb::bytes>> sites;
             for (const auto& [frame, statistics] : error_statistics.sites) {
               const std::vector<double> numbers = pack(statistics);
               sites.emplace_back(state_of(frame),
                                  nb::bytes(reinterpret_cast<const char*>(numbers.data()), 8 * numbers.size()));
             }
             return nb::make_tuple(sites);
           })
      .def("__setstate__",
           [](SiteErrorStatistics& error_statistics, const nb::tuple& state) {
             SiteErrorStatistics read;
             for (const auto& [frame, bytes] : nb::cast<std::vector<std::tuple<FrameState, nb::bytes>>>(state[0])) {
               std::vector<double> numbers(bytes.size() / 8);
               std::memcpy(numbers.data(), bytes.c_str(), 8 * numbers.size());
               read.sites.push_back({frame_in(frame), unpack<ErrorStatistics>(numbers)});
             }
             new (&error_statistics) SiteErrorStatistics(std::move(read));
           })
      .def("__repr__", [](const SiteErrorStatistics& error_statistics) {
        return nb::str("Error statistics({} sites)").format(error_statistics.sites.size());
      });
  module.def("agreed_width_m", &agreed_width_m, "widths_m"_a, "The width that a fleet of several places begins with.");
  module.attr("FLEET_START") = kFleetStart;
  module.attr("FLEET_NOTHING") = kFleetNothing;
  module.def("content_of_tracks", &content_of_tracks, "tracks"_a, "scene"_a, "batch"_a, "config"_a,
             nb::call_guard<nb::gil_scoped_release>(),
             "The episodes of a partition, and the frame of its first track.");
  module.def("content_of_model", &content_of_model, "model"_a, "The same of a partition that is a model.");
  module.def("choose_partitions", &chosen, "episodes"_a, "sites"_a, "are_models"_a, "known"_a,
             "Indices of the partitions in canonical order, and which of their episodes are left out.");
  module.def("plan_fleet", &plan, "partitions"_a, "goes_on"_a, "config"_a,
             "(step, partition, inputs) of every task, in order.");
  module.def("run_task", &run_on_tracks, "step"_a, "tracks"_a, "scene"_a, "batch"_a, "left_out"_a, "inputs"_a,
             "config"_a, "threads"_a, nb::call_guard<nb::gil_scoped_release>(),
             "Does a task on a partition of tracks.");
  module.def("run_task_on_model", &run_on_model, "step"_a, "model"_a.none(), "inputs"_a, "config"_a, "threads"_a,
             nb::call_guard<nb::gil_scoped_release>(), "Does a task on a partition that is a model, or on none.");
  module.def("require_settings", &require_settings, "model"_a, "scene"_a, "config"_a,
             "Rejects a model that cannot be fused with what is learnt under this configuration.");
}

}  // namespace sila::python
