#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sila/core/clean.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/scene.hpp"
#include "sila/service/config.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/config.hpp"

namespace sila {

/// While it exists, all computations of the process use at most `threads` threads; 0: no limit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);

 private:
  std::shared_ptr<void> control_;  ///< oneTBB's; its headers are not needed to use sila
};

/// All settings of the program, the one home of every default. `sila config` prints it.
struct Config {
  CleanConfig clean;
  CornerChoice corners = CornerChoice::primary;
  double metres_per_pixel = 0.0;
  EpisodeConfig episode;  ///< its groups begin paths: fuse.similarity_threshold, predict.horizon_s, ...
  EvaluateConfig evaluate;
  ServiceConfig service;
  SimulationConfig simulate;
};

void fields(MaybeConst<Config> auto& config, auto&& visit) {
  visit.group("clean", config.clean);
  visit.choice("corners", config.corners, kCornerChoices, "which corner of a scene gives the frame of a track");
  visit.number("metres_per_pixel", config.metres_per_pixel, Range{0.0, 1000.0}, "m",
               "scale of tracks in pixels, everywhere in the picture; 0: they are in metres");
  fields(config.episode, visit);
  visit.group("evaluate", config.evaluate);
  visit.group("service", config.service);
  visit.group("simulate", config.simulate);
}

/// The profiles: `default`; `paper`, the published method with one assumption where the paper is silent;
/// `paper-literal`, the literal text. Source: docs/decisions/0100-profiles.md.
inline constexpr const char* kProfiles[] = {"default", "paper", "paper-literal"};

/// The configuration with the values of the named profile for all fields that some profile sets; other fields stay.
/// Throws: std::invalid_argument for an unknown name (with the nearest known one).
Config with_profile(Config config, std::string_view name);

/// The camera for tracks in pixels, with the scale `metres_per_pixel`; null if that is 0. `else_given`: the caller has
/// a camera, scale or scene as well. Throws: std::invalid_argument if both are given.
std::optional<Camera> pixel_camera(const Config& config, bool else_given = false);

/// Throws: std::invalid_argument if models of these configurations are not of one scale, and so cannot be fused.
void require_one_scale(const Config& previous, const Config& incoming);

/// As apply_json. The object may also name a `profile`, which is applied first, so that the other keys override it.
/// Throws: FormatError as apply_json, and for an unknown profile.
Config read_config(Config config, const nlohmann::json& json, std::string_view source);

/// The configuration that a model was learnt with; the defaults for a new one. Predictions need its `episode.predict`.
/// Throws: FormatError, naming `source`, for a field that is unknown or out of range.
Config config_of(const StoredModel& stored, std::string_view source = "model");

/// Throws: std::invalid_argument if the configuration has other units, another interval or another scale of pixels than
/// those that the episodes of the model were learnt with.
void require_same_units(const StoredModel& stored, const Config& config);

/// The corners of a simulated intersection as a scene.
Scene scene_of(const IntersectionScene& simulated);

/// The tracks of a simulation (`config.simulate`), cleaned and in the frames of its corners. Throws: as simulate.
std::vector<FramedTrajectory> simulated_tracks(const Config& config);

/// The prior of a place for which there are no models of other places: of 400 simulated pedestrians, learnt with this
/// configuration. `config.simulate` has no effect. Throws: as make_prior, if the configuration has no error statistics.
/// Source: none in the paper; docs/decisions/0131-simulated-prior.md.
StoredModel simulated_prior(const Config& config);

}  // namespace sila
