#pragma once

#include "sila/core/fields.hpp"

namespace sila {

/// The live service: when tracks and episodes end, which detections are rejected, how predictions are scored, and the
/// limits of connections. A member that is not a setting is not validated: it must be positive.
struct ServiceConfig {
  int batch = 20;
  double stride_s = 0.0;
  double late_s = 0.5;
  /// A time stamp that is newer than the clock by more is off the clock [s].
  static constexpr double clock_jump_s = 10.0;
  /// Consecutive detections that agree with each other but not with the clock of the stream reset it; not a setting.
  int clock_patience = 10;
  /// All tracks of a stream end after this time without a detection, by the clock of the machine [s].
  static constexpr double silence_s = 5.0;
  int max_ids = 2000;
  /// A longer track, of ten minutes at 10 Hz, ends and a new one begins, so that memory is limited; not a setting.
  int max_track_samples = 6000;
  /// Predictions retained until their future is known; further ones are not scored; not a setting.
  int max_pending_scores = 20000;
  /// Tracks that wait to be learnt beside a batch; the oldest of more are discarded; not a setting.
  int max_waiting_tracks = 1000;
  /// Step of the online calibration of nominal regions, for each pedestrian.
  static constexpr double calibration_step = 0.05;
  /// Number of the last pedestrians whose errors and coverage are reported; not a setting.
  int scored_pedestrians = 1000;
  /// The drift alarm compares the error of the last pedestrians with that of the earlier ones [pedestrians].
  static constexpr int drift_pedestrians = 50;
  /// Half width of the band around the error of the earlier pedestrians [standard errors].
  static constexpr double drift_deviations = 4.0;
  int max_line_bytes = 16384;
  double max_rate_hz = 20000.0;
  int max_connections = 64;
  int max_queued_lines = 20000;
  /// Predictions that a connection has not read yet; beyond it the oldest are dropped [MB].
  static constexpr double max_send_queue_mb = 16.0;
  /// Time between updates of the live page [s].
  static constexpr double page_interval_s = 0.2;
};

void fields(MaybeConst<ServiceConfig> auto& config, auto&& visit) {
  visit.number("batch", config.batch, Range{1, 1000000}, "tracks", "finished tracks that make an episode");
  visit.number("stride_s", config.stride_s, Range{0.0, 600.0}, "s",
               "time between the predictions of a pedestrian; 0: one for each detection");
  visit.number("late_s", config.late_s, Range{0.0, 60.0}, "s",
               "a detection may be this much older than the newest of its stream; a track stays open as long");
  visit.number("max_ids", config.max_ids, Range{1, 1000000}, "ids", "open tracks of a stream; more are rejected");
  visit.number("max_line_bytes", config.max_line_bytes, Range{64, 1 << 20}, "bytes",
               "length of a line; longer lines are rejected");
  visit.number("max_rate_hz", config.max_rate_hz, Range{0.0, 1e7, true}, "lines/s",
               "rate of a connection, averaged over a second; more lines are rejected");
  visit.number("max_connections", config.max_connections, Range{1, 10000}, "connections", "open at a time");
  visit.number("max_queued_lines", config.max_queued_lines, Range{1, 10000000}, "lines",
               "lines read and not yet ingested; beyond it a connection with more than its share is rejected");
}

}  // namespace sila
