#pragma once

#include <tbb/global_control.h>

#include <concepts>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sila/core/clean.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/scene.hpp"
#include "sila/service/config.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/config.hpp"

namespace sila {

/// Limits the threads of everything that runs while it exists; 0 means no limit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads) {
    if (threads > 0) control_.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }

 private:
  std::optional<tbb::global_control> control_;
};

/// All settings of the program, the one home of every default. `sila config` prints it.
struct Config {
  CleanConfig clean;
  CornerChoice corners = CornerChoice::primary;
  double metres_per_pixel = 0.0;
  EpisodeConfig episode;  ///< its groups stand at the top level: fuse.similarity_threshold, predict.horizon_s, ...
  EvaluateConfig evaluate;
  ServiceConfig service;
  SimulationConfig simulate;
};

template <class C, class Visitor>
requires std::same_as<std::remove_const_t<C>, Config>
void fields(C& config, Visitor&& visit) {
  visit.group("clean", config.clean);
  visit.choice("corners", config.corners, kCornerChoices, "which corner of a scene gives the frame of a track");
  visit.number("metres_per_pixel", config.metres_per_pixel, Range{0.0, 1000.0}, "m",
               "scale of tracks in pixels, everywhere in the picture; 0: they are in metres");
  fields(config.episode, visit);
  visit.group("evaluate", config.evaluate);
  visit.group("service", config.service);
  visit.group("simulate", config.simulate);
}

/// Names of the profiles: `default`; `paper`, the published method in its fairest reading; `paper-literal`, the same to
/// the letter. Source: docs/decisions/0100-profiles.md.
std::vector<std::string> profile_names();

/// The configuration with every field that any profile sets as the named one has it; all other fields stay.
/// Throws: std::invalid_argument for an unknown name (with the nearest known one).
Config with_profile(Config config, std::string_view name);

/// The whole configuration of a profile. Throws: as with_profile.
Config profile(std::string_view name);

/// The camera of a configuration in pixels, of one scale; null if `metres_per_pixel` is 0. Throws:
/// std::invalid_argument if it is not and something `else_given` makes metres of positions, too.
std::optional<Camera> pixel_camera(const Config& config, bool else_given = false);

/// Throws: std::invalid_argument if models of these configurations are not of one scale, and so cannot be fused.
void require_one_scale(const Config& previous, const Config& incoming);

/// As apply_json; beside fields the object may name a `profile`, which comes first, so that its fields may be set
/// beside it. Throws: FormatError as apply_json, and for an unknown profile.
Config read_config(Config config, const nlohmann::json& json, std::string_view source);

}  // namespace sila
