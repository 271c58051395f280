#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "sila/core/clean.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/service/rejection.hpp"
#include "sila/service/scores.hpp"

namespace sila {

/// All settings of the stream core.
struct ServiceSettings {
  ServiceConfig service;
  CleanConfig clean;
  EpisodeConfig episode;
  EvaluateConfig evaluate;
  /// The corner whose frame a track is mapped to, such as `live_frame`; must be set.
  std::function<CurbFrame(const Trajectory&)> frame_for;
  LineFormat lines;                   ///< how predictions are written
  std::optional<Camera> camera = {};  ///< detections are image points [pixels], predictions have `u`, `v` too
};

/// The clock of a stream: its newest accepted time stamp but `ahead_s`.
struct StreamClock {
  std::optional<double> now_s = {};
  std::optional<double> ahead_s = {};  ///< of the last accepted stamp, if it is newer by over service.late_s
  double since_s = 0.0;                ///< first of the stamps that agree with each other but not with the clock
  double candidate_s = 0.0;            ///< newest of them
  int agreeing = 0;                    ///< number of those stamps, consecutive
};

/// A track that may continue. Invariant: `path` is the last of the trajectories that `clean` makes of `rows`, or empty
/// if there is none, so that streams and files are cleaned by the same rules.
struct OpenTrack {
  std::vector<Detection> rows;  ///< in order of arrival, without exact repetitions of the last
  Trajectory path;
  double latest_s = 0.0;  ///< newest stamp of the rows
};

/// A pedestrian whose track is open.
struct Pedestrian {
  OpenTrack track;
  double due_s = 0.0;              ///< when the next prediction is due, on the clock of the stream
  bool queued = false;             ///< is in `Stream::due`
  bool score_queued = false;       ///< is in `StreamCore::due_scores`
  double arrived_s = 0.0;          ///< arrival of the detection to predict from, on the clock of the caller
  double stamp_s = 0.0;            ///< its time
  std::deque<Prediction> pending;  ///< retained until their futures are known
  PedestrianScore score;
};

using StreamId = std::uint64_t;

/// The detections of one tracker, with ids and a clock of their own.
struct Stream {
  StreamClock clock;
  std::map<std::string, Pedestrian> pedestrians;
  std::deque<std::string> due;      ///< tracks whose prediction is due, the longest waiting first
  double checked_s = 0.0;           ///< when the ends of tracks were last checked
  std::uint64_t checked_ids = 0;    ///< detections whose id was checked
  std::uint64_t contradictory = 0;  ///< of them, at another place than the one before of the same id and time
};

/// Counts of all detections: detections = not_due + predictions + superseded + those in `Stream::due`.
struct Counters {
  std::uint64_t detections = 0;
  std::uint64_t not_due = 0;      ///< the track was too short, or `stride_s` had not passed
  std::uint64_t predictions = 0;  ///< requested
  std::uint64_t superseded = 0;   ///< due, and replaced by a newer detection before it was requested
  std::uint64_t scored = 0;
  std::uint64_t unscorable = 0;    ///< the track ended before the horizon
  std::uint64_t not_retained = 0;  ///< service.max_pending_scores were pending
  std::uint64_t pending_scores = 0;
  std::uint64_t tracks = 0;  ///< ended
  std::uint64_t clock_resets = 0;
};

/// The state of the stream core: detections in, prediction requests out, predictions scored. It uses no socket, thread
/// or clock of the machine, and every list in it has a limit. One thread at a time may use it. A caller that gets no
/// detections for service.silence_s calls `end_tracks`. LiveStream (sila/live_stream.hpp) does all this for one
/// tracker.
struct StreamCore {
  std::map<StreamId, Stream> streams;
  StreamId last_served = 0;                                 ///< the stream of the last prediction request
  std::deque<std::pair<StreamId, std::string>> due_scores;  ///< tracks whose oldest prediction can be scored
  RecentScores scores;
  OnlineCalibration online_calibration;
  Counters counters;
  std::vector<FramedTrajectory> finished;  ///< tracks to learn; the caller removes them
  std::vector<Trajectory> first_tracks;    ///< as received, until `warnings` are made of them
  std::vector<std::string> warnings;  ///< of other units or ids, or that nothing is predicted; the caller removes them
  std::vector<WindowScore> windows;   ///< scored windows, if `keep_windows`
  bool keep_windows = false;
};

/// The outcome of one detection.
struct IngestResult {
  std::optional<Rejection> rejection;
  std::uint64_t superseded = 0;  ///< predictions that were due and will not be made
};

/// The observed path of a pedestrian whose prediction is due.
struct PredictionRequest {
  StreamId stream = 0;
  std::string track;
  double arrived_s = 0.0;
  CurbTrajectory observed;
};

/// Adds a detection that arrived at `arrived_s`, on any clock of the caller; it is given back in the request. Throws:
/// std::invalid_argument for settings out of range.
IngestResult ingest(StreamCore& core, StreamId stream, const Detection& given, double arrived_s,
                    const ServiceSettings& settings);

/// Number of tracks whose prediction is due.
std::size_t due_predictions(const StreamCore& core);

/// At most `count` due predictions. Streams take turns; within a stream the longest waiting is first.
std::vector<PredictionRequest> take_due_requests(StreamCore& core, std::size_t count, const ServiceSettings& settings);

/// Retains a prediction, as it was sent, until its future is known.
void retain(StreamCore& core, const PredictionRequest& request, const Prediction& prediction,
            const ServiceSettings& settings);

/// Scores the predictions of at most `count` pedestrians whose future is known and final. Separate from `ingest`, so
/// that the caller can predict first.
void score_due(StreamCore& core, std::size_t count, const ServiceSettings& settings);

/// Ends every open track of a stream; the stream itself stays.
void end_tracks(StreamCore& core, StreamId stream, const ServiceSettings& settings);
/// The same if the clock of the stream stands still for service.silence_s until `now_s`.
void end_if_silent(StreamCore& core, StreamId stream, double now_s, const ServiceSettings& settings);
/// Ends every open track of a stream, and removes the stream.
void end_stream(StreamCore& core, StreamId stream, const ServiceSettings& settings);

}  // namespace sila
