#pragma once

#include <concepts>

#include "sila/core/sampling.hpp"
#include "sila/fuse/config.hpp"
#include "sila/learn/config.hpp"
#include "sila/model/outlook.hpp"
#include "sila/predict/config.hpp"

namespace sila {

/// What past errors teach.
struct LessonConfig {
  bool enabled = true;
  double every_s = 1.6;
  double decay = 0.97;
  int tree_rounds = 2;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, LessonConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("enabled", config.enabled, "predict each batch before it is learnt, and learn from the errors");
  visit.number("every_s", config.every_s, Range{0.0, 60.0, true}, "s",
               "between the windows of a track that are predicted");
  visit.number("decay", config.decay, Range{0.0, 1.0, true}, "per episode", "how much older lessons still count");
  visit.number("tree_rounds", config.tree_rounds, Range{1, 20}, "-",
               "how often each half of a fleet is predicted by the other half, the last time to learn from the errors");
}

/// Everything that an episode is governed by.
struct EpisodeConfig {
  SamplingConfig sampling;
  CurbScaling scaling = CurbScaling::mean_width;
  double reference_width_m = 0.0;
  LearnConfig learn;
  OutlookConfig outlook;
  FuseConfig fuse;
  LessonConfig lessons;
  PredictConfig predict;
};

inline constexpr const char* kCurbScalings[] = {"mean_width", "strip_widths"};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, EpisodeConfig>
void fields(Config& config, Visitor&& visit) {
  visit.group("sampling", config.sampling);
  visit.choice("scaling", config.scaling, kCurbScalings, "how lengths along the curbs become sidewalk widths");
  visit.number(
      "reference_width_m", config.reference_width_m, Range{0.0, 100.0}, "m",
      "sidewalk width by which metres become widths of the model, the same for models that are to be fused; 0: "
      "that of the place where the model begins");
  visit.group("learn", config.learn);
  visit.group("outlook", config.outlook);
  visit.group("fuse", config.fuse);
  visit.group("lessons", config.lessons);
  visit.group("predict", config.predict);
}

}  // namespace sila
