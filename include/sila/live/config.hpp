#pragma once

#include <concepts>

#include "sila/core/fields.hpp"

namespace sila {

/// A tracker's stream: when tracks begin and end, what is refused, when an episode begins, how predictions are judged.
struct LiveConfig {
  int batch = 20;
  double every_s = 0.0;
  double late_s = 0.5;
  /// A detection that is newer by more is off the clock while others are on it [s].
  static constexpr double clock_jump_s = 10.0;
  int clock_patience = 10;
  double silence_s = 5.0;
  int max_ids = 2000;
  int max_track_samples = 6000;
  int max_unscored = 20000;
  int max_waiting_tracks = 1000;
  double calibration_step = 0.05;
  int remembered = 1000;
  /// Whose error is watched for drift [pedestrians].
  static constexpr int drift_pedestrians = 50;
  /// Half width of the band round the error of those before [standard errors].
  static constexpr double drift_deviations = 4.0;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, LiveConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("batch", config.batch, Range{1, 1000000}, "tracks", "finished tracks that make an episode");
  visit.number("every_s", config.every_s, Range{0.0, 600.0}, "s",
               "between the predictions of a pedestrian; 0: at each detection");
  visit.number("late_s", config.late_s, Range{0.0, 60.0}, "s",
               "a detection may be this much older than the newest of its stream; a track waits for it as long");
  visit.number("clock_patience", config.clock_patience, Range{1, 100000}, "detections",
               "so many in a row that agree with each other and not with the clock set it anew");
  visit.number("silence_s", config.silence_s, Range{0.0, 3600.0, true}, "s",
               "without a detection, by the clock on the wall, after which all tracks of a stream have ended");
  visit.number("max_ids", config.max_ids, Range{1, 1000000}, "ids", "open tracks of a stream; more are refused");
  visit.number("max_track_samples", config.max_track_samples, Range{100, 10000000}, "samples",
               "a longer track ends and begins anew");
  visit.number("max_unscored", config.max_unscored, Range{0, 10000000}, "predictions",
               "that wait for their future; beyond it the newest are not scored");
  visit.number("max_waiting_tracks", config.max_waiting_tracks, Range{1, 10000000}, "tracks",
               "that wait to be learnt; beyond it the oldest are forgotten");
  visit.number("calibration_step", config.calibration_step, Range{0.0, 1.0}, "per pedestrian",
               "how fast nominal regions follow how often they held; 0: never");
  visit.number("remembered", config.remembered, Range{10, 1000000}, "pedestrians", "that running figures are over");
}

}  // namespace sila
