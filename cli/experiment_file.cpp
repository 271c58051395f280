#include "experiment_file.hpp"

#include <cstdio>
#include <cstring>
#include <iostream>
#include <set>

#include "sila/core/clean.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "sila/profile.hpp"
#include "sila/sim/simulate.hpp"

namespace sila::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// An object of the file, with where it stands, for messages.
struct Item {
  const json& value;
  std::string file;
  std::string where;
};

/// A name as it stands in the file: also one of no letters is seen.
std::string quoted(const std::string& name) {
  return json(name).dump();
}

void require_object(const Item& item, const std::vector<std::string>& known) {
  if (!item.value.is_object()) throw FormatError(item.file, 0, item.where + " to be an object", item.value.dump());
  for (const auto& [key, value] : item.value.items()) {
    if (std::ranges::find(known, key) != known.end()) continue;
    throw FormatError(item.file, 0,
                      "a known key in " + item.where + " (the nearest is " + nearest_name(key, known) + ")",
                      quoted(key));
  }
}

std::string text_at(const Item& item, const char* key) {
  const auto found = item.value.find(key);
  if (found == item.value.end() || !found->is_string()) {
    throw FormatError(item.file, 0, item.where + " with a text \"" + key + "\"",
                      found == item.value.end() ? "no such key" : found->dump());
  }
  return *found;
}

template <Configuration Part>
Part with(Part config, const Item& item, const char* key) {
  if (!item.value.contains(key)) return config;
  const std::string source = item.file + ", " + item.where;
  if constexpr (std::same_as<Part, Config>)
    return read_config(config, item.value.at(key), source);
  else
    return apply_json(config, item.value.at(key), source);
}

/// The entries of a list that must be there and not empty.
const json& list_at(const Item& item, const char* key) {
  const auto found = item.value.find(key);
  if (found == item.value.end() || !found->is_array() || found->empty()) {
    throw FormatError(item.file, 0, item.where + " with a list \"" + key + "\" that is not empty",
                      found == item.value.end() ? "no such key" : found->dump());
  }
  return *found;
}

fs::path found_file(const std::string& name, const ExperimentOptions& options, const std::string& what) {
  const fs::path folder = fs::path(options.file).parent_path();
  std::vector<fs::path> places{folder / name};
  if (!options.data_dir.empty()) places.push_back(fs::path(options.data_dir) / name);
  for (const fs::path& path : places) {
    if (fs::exists(path)) return path;
  }
  throw FormatError(
      options.file, 0,
      what + " beside the experiment file" +
          (options.data_dir.empty() ? " (or in --data-dir, which is not given)" : " or in " + options.data_dir),
      quoted(name));
}

/// Simulated tracks, cleaned as those of a tracker.
std::vector<FramedTrajectory> simulated(const Config& config) {
  const Simulation simulation = simulate(config.simulate);
  Scene scene;
  const double width_m = simulation.scene.sidewalk_width_m;
  for (const NamedCorner& corner : simulation.scene.corners)
    scene.corners.push_back({corner.name, corner.frame, {width_m, width_m, width_m}});
  Detections detections;
  detections.source = "simulated";
  for (const Trajectory& track : simulation.tracks) {
    for (std::size_t i = 0; i < track.times_s.size(); ++i)
      detections.rows.push_back({track.id, track.times_s[i], track.positions_m[i]});
  }
  detections.rows_read = detections.rows.size();
  return placed(clean(std::span(&detections, 1), config.clean).trajectories, scene, config.corners);
}

std::vector<FramedTrajectory> recorded(const std::string& name, const Config& config,
                                       const ExperimentOptions& options) {
  const Scene scene = read_scene(found_file(name, options, "the scene file"), config.episode.scaling, options.data_dir);
  return placed(read_scene_tracks(scene, config.clean).trajectories, scene, config.corners);
}

std::size_t count_recordings(const std::vector<FramedTrajectory>& tracks) {
  std::size_t count = 0;
  for (const FramedTrajectory& placed : tracks) count = std::max(count, placed.track.recording + 1);
  return count;
}

struct ReadPlace {
  Place place;
  Config config;
};

ReadPlace read_place(const Item& item, const Config& base, const ExperimentOptions& options) {
  require_object(item, {"name", "scene", "scenes", "simulate", "config"});
  ReadPlace read{{text_at(item, "name"), {}, {}}, with(base, item, "config")};
  const int sources = static_cast<int>(item.value.contains("scene")) + static_cast<int>(item.value.contains("scenes")) +
                      static_cast<int>(item.value.contains("simulate"));
  if (sources != 1)
    throw FormatError(item.file, 0, item.where + " with one of scene, scenes and simulate", std::to_string(sources));
  read.config.simulate = with(read.config.simulate, item, "simulate");
  CommonOptions sets = options.common;
  sets.seed.reset();
  read.config = configured(sets, read.config);
  std::cerr << "reading " << read.place.name << "\n";
  if (item.value.contains("simulate")) read.place.tracks = simulated(read.config);
  if (item.value.contains("scene")) read.place.tracks = recorded(text_at(item, "scene"), read.config, options);
  for (const json& name : item.value.contains("scenes") ? list_at(item, "scenes") : json::array()) {
    if (!name.is_string()) throw FormatError(item.file, 0, item.where + ", scenes to be texts", name.dump());
    const std::size_t recordings = count_recordings(read.place.tracks);
    for (FramedTrajectory& track : recorded(name, read.config, options)) {
      track.track.recording += recordings;
      track.track.id =
          fs::path(name.get<std::string>()).stem().string() + ":" + track.track.id;  // ids are a scene's own
      read.place.tracks.push_back(std::move(track));
    }
  }
  read.place.evaluate = read.config.evaluate;
  return read;
}

/// What decides which windows are judged and how: the same for all methods, or their errors could not be compared.
std::string judged_part(const Config& config) {
  const nlohmann::ordered_json all = to_json(config);
  return nlohmann::ordered_json{all.at("clean"),
                                all.at("corners"),
                                all.at("sampling").at("interval_s"),
                                all.at("evaluate"),
                                all.at("predict").at("observe_s"),
                                all.at("predict").at("horizon_s")}
      .dump();
}

MethodKind kind_named(const std::string& name, const Item& item) {
  const auto found = std::ranges::find(kMethodKinds, name);
  if (found != std::end(kMethodKinds)) return static_cast<MethodKind>(found - std::begin(kMethodKinds));
  const std::vector<std::string> known(std::begin(kMethodKinds), std::end(kMethodKinds));
  throw FormatError(item.file, 0,
                    "a known method in " + item.where + " (the nearest is " + nearest_name(name, known) + ")",
                    quoted(name));
}

/// One method at every place.
MethodAtPlaces read_method(const Item& item, const std::vector<ReadPlace>& places) {
  Method method;
  const std::string kind = item.value.contains("method") ? text_at(item, "method") : text_at(item, "name");
  method.name = item.value.contains("name") ? text_at(item, "name") : kind;
  method.kind = kind_named(kind, item);
  method.memory = with(method.memory, item, "memory");
  method.cliff = with(method.cliff, item, "cliff");
  method.tree = with(method.tree, item, "tree");
  MethodAtPlaces everywhere;
  for (const ReadPlace& place : places) {
    const Config config = with(place.config, item, "config");
    if (judged_part(config) != judged_part(place.config)) {
      throw FormatError(item.file, 0,
                        item.where +
                            " to leave clean, corners, sampling.interval_s, evaluate, predict.observe_s and "
                            "predict.horizon_s as the scene has them, so that all are judged alike",
                        "a change of one of them");
    }
    method.config = config.episode;
    everywhere.push_back(method);
  }
  return everywhere;
}

/// The methods of an entry: one, or one a similarity threshold.
std::vector<MethodAtPlaces> read_methods(const Item& item, const std::vector<ReadPlace>& places) {
  if (item.value.is_string()) {
    const json whole{{"method", item.value}};
    return {read_method({whole, item.file, item.where}, places)};
  }
  require_object(item, {"name", "method", "thresholds", "config", "memory", "cliff", "tree"});
  if (!item.value.contains("thresholds")) return {read_method(item, places)};
  std::vector<MethodAtPlaces> methods;
  for (const json& threshold : list_at(item, "thresholds")) {
    MethodAtPlaces everywhere = read_method(item, places);
    const json set{{"similarity_threshold", threshold}};
    for (Method& method : everywhere) {
      method.name += " " + threshold.dump();
      method.config.fuse = apply_json(method.config.fuse, set, item.file + ", " + item.where);
    }
    methods.push_back(std::move(everywhere));
  }
  return methods;
}

std::string hash_of_tracks(const std::vector<FramedTrajectory>& tracks) {
  std::string bytes;
  const auto add = [&](double value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof raw);
  };
  for (const FramedTrajectory& placed : tracks) {
    bytes += placed.track.id + "\n";
    for (double t : placed.track.times_s) add(t);
    for (const Vector2& p : placed.track.positions_m) add(p.x()), add(p.y());
    for (const Vector2& v : {placed.frame.origin_m, placed.frame.axis_1, placed.frame.axis_2, placed.frame.unit_m})
      add(v.x()), add(v.y());
  }
  return hash_of(bytes);
}

std::string reference_of(const Item& item, const std::vector<MethodAtPlaces>& methods) {
  std::vector<std::string> names;
  for (const MethodAtPlaces& method : methods) names.push_back(method[0].name);
  if (!item.value.contains("reference"))
    return std::ranges::find(names, "sila") != names.end() ? "sila" : names.front();
  const std::string name = text_at(item, "reference");
  if (std::ranges::find(names, name) == names.end())
    throw FormatError(item.file, 0, "reference to be a method (the nearest is " + nearest_name(name, names) + ")",
                      quoted(name));
  return name;
}

/// Models that go from place to place have one configuration.
void require_one_configuration(const Experiment& experiment, const std::string& file) {
  if (experiment.config.kind == ExperimentKind::one_place) return;
  for (const MethodAtPlaces& method : experiment.methods) {
    for (std::size_t p = 1; p < method.size(); ++p) {
      if (to_json(method[p].config) == to_json(method[0].config)) continue;
      throw FormatError(file, 0,
                        "scenes of one configuration, as a model goes from one to the next (put it in the "
                        "\"config\" of the experiment)",
                        "another for " + experiment.places[p].name);
    }
  }
}

nlohmann::ordered_json resolved_json(const ReadExperiment& read, const std::vector<ReadPlace>& places) {
  nlohmann::ordered_json resolved = to_json(read.experiment.config);
  resolved["reference"] = read.reference;
  for (std::size_t p = 0; p < places.size(); ++p) {
    resolved["scenes"][places[p].place.name] = {{"tracks", read.experiment.places[p].tracks.size()},
                                                {"tracks_hash", read.track_hashes[p]},
                                                {"config", to_json(places[p].config)}};
  }
  for (const MethodAtPlaces& method : read.experiment.methods) {
    nlohmann::ordered_json& item = resolved["methods"][method[0].name];
    item["method"] = kMethodKinds[static_cast<std::size_t>(method[0].kind)];
    if (method[0].kind == MethodKind::memory) item["memory"] = to_json(method[0].memory);
    if (method[0].kind == MethodKind::cliff) item["cliff"] = to_json(method[0].cliff);
    if (method[0].kind == MethodKind::tree) item["tree"] = to_json(method[0].tree);
    for (std::size_t p = 0; p < method.size(); ++p) item["config"][places[p].place.name] = to_json(method[p].config);
  }
  return resolved;
}

}  // namespace

std::string hash_of(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037ull;
  for (char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 1099511628211ull;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

ReadExperiment read_experiment(const ExperimentOptions& options) {
  const json file = read_json(options.file);
  const Item whole{file, options.file, "the experiment"};
  ReadExperiment read;
  ExperimentConfig& config = read.experiment.config;
  std::vector<std::string> known{"about", "config", "scenes", "methods", "reference"};
  for (const Field& field : collect_fields(config)) known.push_back(field.path);
  require_object(whole, known);
  json values = file;
  for (const char* key : {"about", "config", "scenes", "methods", "reference"}) values.erase(key);
  config = apply_json(config, values, options.file);
  if (options.trials) config.trials = *options.trials;
  if (options.split) config.split = *options.split;
  if (options.common.seed) config.seed = *options.common.seed;
  const Config base = with(Config{}, whole, "config");
  std::vector<ReadPlace> places;
  for (const json& item : list_at(whole, "scenes")) {
    places.push_back(read_place({item, options.file, "scene " + std::to_string(places.size() + 1)}, base, options));
  }
  int number = 0;
  for (const json& item : list_at(whole, "methods")) {
    for (MethodAtPlaces& method : read_methods({item, options.file, "method " + std::to_string(++number)}, places)) {
      read.experiment.methods.push_back(std::move(method));
    }
  }
  for (ReadPlace& place : places) {
    read.track_hashes.push_back(hash_of_tracks(place.place.tracks));
    read.experiment.places.push_back(std::move(place.place));
    place.place.name = read.experiment.places.back().name;
  }
  check(read.experiment);
  require_one_configuration(read.experiment, options.file);
  read.reference = reference_of(whole, read.experiment.methods);
  read.resolved = resolved_json(read, places);
  return read;
}

}  // namespace sila::cli
