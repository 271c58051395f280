#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sila/config.hpp"
#include "sila/core/camera.hpp"
#include "sila/core/detections.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/scene.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/service/server.hpp"

namespace sila {

/// Model, configuration, scene and camera of a new LiveStream.
struct LiveStreamOptions {
  /// Model file that is continued, or created with the first episode (at once if `start` has records); each episode is
  /// stored in it. Unset: the model is kept in memory only.
  std::optional<std::filesystem::path> file = {};
  /// The model at the beginning, if there is no file or the file has no episode; may be empty.
  StoredModel start = {};
  /// Unset: that of the model (config_of), for a new model the defaults.
  std::optional<Config> config = {};
  /// The place. Without a corner: that of the model; a new model makes its frame from its first batch.
  Scene scene = {};
  /// Makes metres of image points. Unset: detections are in metres, in the frame of the scene.
  std::optional<Camera> camera = {};
};

/// One prediction of a LiveStream.
struct LivePrediction {
  std::string track;      ///< id of the detections
  std::string tracklet;   ///< unique: "17#2" is the second tracklet of id 17
  Prediction prediction;  ///< t0 is the time of the last detection that was used
};

/// What `sila serve` does for one tracker, without sockets: detections in, predictions out. Finished tracks are learnt
/// in a thread of its own; predictions never wait for learning.
/// Threads: all functions may be called from any thread; calls of `update` run one after the other. One prediction
/// uses one processor, those of one call all of them.
class LiveStream {
 public:
  /// Throws: FormatError for a model file that cannot be used; std::invalid_argument for a configuration out of range
  /// or one that contradicts the model, for a camera with a model in pixels, and for a scene as scene_for does.
  explicit LiveStream(LiveStreamOptions options);
  /// Finishes the running episode. Open tracks, and those that wait for a batch, are lost: call `close` before.
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Adds the detections of one moment and returns the predictions that are due: at most one for each pedestrian, from
  /// the newest detection. All earlier predictions whose future is known are scored before it returns. Faulty
  /// detections are data, not errors: they are rejected and counted (`metrics`; the rules are in docs/service.md). Call
  /// it for moments without detections, too: a call that accepts none, and has none off the clock, ends all tracks if
  /// `now_s`, on the clock of the detections, is 5 s after the newest accepted one. Units: seconds on any clock;
  /// metres, or pixels with a camera. Throws: std::invalid_argument after `close`.
  std::vector<LivePrediction> update(double now_s, std::span<const Detection> detections);

  /// Ends all tracks and learns them, the last in a smaller batch; returns when it is done.
  void close();

  /// Returns when no whole batch waits to be learnt, so that the result for a recording does not depend on speed.
  void wait();

  /// The model after the last complete episode, with the records of all episodes: the content of the model file, or a
  /// copy. Throws: FormatError for a model file that cannot be read.
  StoredModel model() const;

  /// Returns each new warning once: positions that do not look like metres, episodes that failed.
  std::vector<std::string> take_warnings();

  /// Counts of detections, rejections and episodes; errors and coverage of recent pedestrians. An episode that failed,
  /// for instance because the disk is full, is in `learner.failed_episodes` and `learner.last_error`. Those of lines
  /// and connections are zero, and so is `latency`.
  ServiceMetrics metrics() const;

  /// The camera in use: that of the options, or that of a model in pixels; null for detections in metres.
  const Camera* camera() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sila
