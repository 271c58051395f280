#include "sila/config.hpp"

#include <tbb/global_control.h>

#include <algorithm>
#include <array>

#include "core/concatenate.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "sila/train/episode.hpp"

namespace sila {
namespace {

/// Pedestrians of a simulated prior: with 80 it predicts worse, with 1000 no better.
constexpr int kPriorTracks = 400;

/// A field that a profile sets.
struct Setting {
  const char* path;
  std::array<const char*, 2> values;  ///< of `paper` and `paper-literal`; none: the default
};

// Off in both: what we added to the paper. The reasons of the others and what each is worth: docs/decisions/0100.
constexpr Setting kSettings[] = {
    {"residual.enabled", {"false", "false"}},
    {"error_statistics.enabled", {"false", "false"}},
    {"predict.stacking", {"false", "false"}},
    {"prune.enabled", {"false", "false"}},
    {"scaling", {"mean_width", "mean_width"}},
    {"sampling.acceleration_density", {"0.05", "0.05"}},
    {"fuse.sites", {"shared", "shared"}},
    {"fuse.split_credit", {"false", "false"}},
    {"learn.dictionary.cut", {"first_unexplained", "first_unexplained"}},
    {"learn.dictionary.support_mask", {nullptr, "false"}},
    {"learn.field.outputs", {nullptr, "independent"}},
    {"learn.field.stride_s", {"0.8", nullptr}},
    {"learn.field.pseudo_inputs", {nullptr, "optimised"}},
    {"learn.field.max_pseudo_inputs", {nullptr, "20"}},
    {"fuse.strict_relax", {nullptr, "true"}},
    {"fuse.both_directions", {nullptr, "false"}},
    {"fuse.literal_self_transitions", {nullptr, "true"}},
    {"fuse.gp_fusion", {nullptr, "pseudo_data"}},
    {"predict.likelihood_s", {"3.2", "3.2"}},
    {"predict.likelihood_power", {"0.25", "1"}},
    {"predict.prior", {"none", "transition_probability"}},
    {"predict.max_shortlisted", {"32", "32"}},
    {"predict.max_candidates", {"8", "8"}},
    {"predict.merge_radius_m", {"2", "0"}},
    {"predict.own_deviation", {"true", nullptr}},
};

std::optional<std::size_t> number_of(std::string_view name) {
  const auto found = std::ranges::find(kProfiles, name);
  if (found == std::end(kProfiles)) return std::nullopt;
  return static_cast<std::size_t>(found - std::begin(kProfiles));
}

std::string expected_instead(std::string_view name) {
  return "a known profile (the nearest is " + nearest_name(name, kProfiles) + ")";
}

}  // namespace

Config with_profile(Config config, std::string_view name) {
  const std::optional<std::size_t> number = number_of(name);
  if (!number)
    throw std::invalid_argument("profile: expected " + expected_instead(name) + ", found " + std::string(name));
  Config defaults;
  const std::vector<Field> from = collect_fields(defaults);
  const std::vector<Field> to = collect_fields(config);
  for (const auto& [path, values] : kSettings) {
    const auto field = static_cast<std::size_t>(std::ranges::find(to, path, &Field::path) - to.begin());
    const char* const value = *number == 0 ? nullptr : values[*number - 1];
    if (value)
      field_from_assignment(to, std::string(path) + "=" + value);
    else
      to.at(field).write(from.at(field).read());
  }
  return config;
}

std::optional<Camera> pixel_camera(const Config& config, bool else_given) {
  if (config.metres_per_pixel == 0.0) return std::nullopt;
  if (else_given) {
    throw invalid_argument(
        "metres_per_pixel = ", config.metres_per_pixel,
        " makes metres of pixels already; give no camera and no metres per unit, or learn a new model with them");
  }
  return flat_camera(config.metres_per_pixel);
}

void require_one_scale(const Config& previous, const Config& incoming) {
  if (previous.metres_per_pixel == incoming.metres_per_pixel) return;
  throw invalid_argument("fuse: the models are not of one scale: metres_per_pixel = ", previous.metres_per_pixel,
                         " and ", incoming.metres_per_pixel);
}

Config read_config(Config config, const nlohmann::json& json, std::string_view source) {
  if (!json.is_object() || !json.contains("profile")) return apply_json(std::move(config), json, source);
  const nlohmann::json& name = json.at("profile");
  const bool known = name.is_string() && number_of(name.get<std::string>());
  if (!known) {
    throw FormatError(std::string(source), 0, expected_instead(name.is_string() ? name.get<std::string>() : ""),
                      name.dump());
  }
  nlohmann::json fields = json;
  fields.erase("profile");
  return apply_json(with_profile(std::move(config), name.get<std::string>()), fields, source);
}

ThreadLimit::ThreadLimit(int threads) {
  if (threads <= 0) return;
  control_ = std::make_shared<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                   static_cast<std::size_t>(threads));
}

Config config_of(const StoredModel& stored, std::string_view source) {
  const nlohmann::json json = nlohmann::json::parse(stored.configuration, nullptr, false);
  if (json.is_discarded()) throw FormatError(std::string(source), 0, "a configuration that is JSON", "another text");
  return apply_json(Config{}, json, source);
}

void require_same_units(const StoredModel& stored, const Config& config) {
  require_same_units(stored.model, config.episode);
  if (stored.model.episodes == 0) return;
  const double scale = config.metres_per_pixel, learnt_at = config_of(stored).metres_per_pixel;
  if (scale == learnt_at) return;
  throw invalid_argument("config: metres_per_pixel = ", scale, ", but the model was learnt ",
                         learnt_at > 0.0 ? concatenate("at metres_per_pixel = ", learnt_at) : "in metres",
                         "; learn a new one");
}

Scene scene_of(const IntersectionScene& simulated) {
  Scene scene;
  scene.name = "simulated " + simulated.name;
  const double width_m = simulated.sidewalk_width_m;
  for (const NamedCorner& corner : simulated.corners)
    scene.corners.push_back({corner.name, corner.frame, {width_m, width_m, width_m}});
  return scene;
}

std::vector<FramedTrajectory> simulated_tracks(const Config& config) {
  const Simulation simulation = simulate(config.simulate);
  Detections detections{"simulated", {}, 0};
  for (const Trajectory& track : simulation.tracks) {
    for (std::size_t i = 0; i < track.times_s.size(); ++i)
      detections.rows.push_back({track.id, track.times_s[i], track.positions_m[i]});
  }
  detections.rows_read = detections.rows.size();
  std::vector<FramedTrajectory> tracks = without_frames(clean(std::span(&detections, 1), config.clean).trajectories);
  place(tracks, scene_of(simulation.scene), config.corners, config.episode.scaling);
  return tracks;
}

StoredModel simulated_prior(const Config& config) {
  if (!config.episode.error_statistics.enabled)
    throw std::invalid_argument(
        "prior: error_statistics.enabled = false, but a prior consists of error statistics; set it to true");
  Config simulated = config;
  simulated.simulate = {};
  simulated.simulate.tracks = kPriorTracks;
  StoredModel stored;
  stored.model = run_episodes({}, simulated_tracks(simulated), static_cast<std::size_t>(config.service.batch),
                              config.episode, sila_update(config.episode))
                     .model;
  stored.configuration = to_json(config).dump();
  return stored_prior(std::span(&stored, 1));
}

}  // namespace sila
