#pragma once

#include <concepts>

#include "sila/core/clean.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/scene.hpp"
#include "sila/service/config.hpp"
#include "sila/sim/config.hpp"
#include "sila/train/config.hpp"

namespace sila {

/// All settings of the program, the one home of every default. `sila config` prints it.
struct Config {
  CleanConfig clean;
  CornerChoice corners = CornerChoice::primary;
  EpisodeConfig episode;  ///< its groups stand at the top level: fuse.similarity_threshold, predict.horizon_s, ...
  EvaluateConfig evaluate;
  ServiceConfig service;
  SimulationConfig simulate;
};

template <class C, class Visitor>
requires std::same_as<std::remove_const_t<C>, Config>
void fields(C& config, Visitor&& visit) {
  visit.group("clean", config.clean);
  visit.choice("corners", config.corners, kCornerChoices, "by which corner of a scene its tracks are looked at");
  fields(config.episode, visit);
  visit.group("evaluate", config.evaluate);
  visit.group("service", config.service);
  visit.group("simulate", config.simulate);
}

}  // namespace sila
