#include <tbb/parallel_for.h>

#include <limits>
#include <mutex>
#include <stdexcept>

#include "arrays.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"
#include "sila/service/learner_thread.hpp"
#include "sila/service/server.hpp"

namespace sila::python {
namespace {

constexpr StreamId kStream = 1;
/// Of an id, as for `sila serve` [bytes].
constexpr std::size_t kLongestId = 64;

/// The service without sockets: the stream core for one tracker, and the learner thread. Calls may come from any
/// thread; each method holds `mutex_` while it uses the core.
class LiveStream {
 public:
  /// Begins with the model in `file`, if there is one, and stores every episode there; else with `start`. `metres`:
  /// positions are metres even if the scene has a camera.
  LiveStream(const StoredModel& start, const std::optional<std::filesystem::path>& file, const ScaledScene& scene,
             const std::optional<std::filesystem::path>& camera, bool metres, const std::string& config_json)
      : config_(config_of(config_json)),
        stored_(start),
        scene_(scene.as(config_.episode.scaling)),
        settings_{config_.service, config_.clean, config_.episode, config_.evaluate, [this](const Trajectory& track) {
                    return live_frame(scene_, learner_->snapshot()->model, track, config_.corners);
                  }} {
    if (file) file_ = ModelFile::open_or_create(*file);
    if (file_ && !file_->empty()) stored_ = file_->read();
    settings_.camera = pixel_camera(config_, camera.has_value());
    if (scene_.camera && !settings_.camera && !camera && !metres)
      throw std::invalid_argument(
          "Stream: scene has a camera: expected camera= with its file for image points, or camera=False for metres");
    if (camera) settings_.camera = read_camera(*camera).camera;
    stored_.configuration = to_json(config_).dump();
    if (!stored_.episodes.empty()) core_.online_calibration = calibration_in(stored_.episodes.back().statistics);
    learner_.emplace(
        stored_.model, core_.online_calibration, config_.episode, config_.service,
        LearnerThread::Storage{[this](const Model& previous, const Episode& episode,
                                      const OnlineCalibration& calibration) { commit(previous, episode, calibration); },
                               [this] { return reload(); }});
  }

  /// The predictions that are due after the detections of one moment, in their order. An empty label is a pedestrian.
  std::vector<TrackPrediction> update(double t_s, const std::vector<std::string>& ids, nb::handle points,
                                      const std::vector<std::string>& labels) {
    const std::vector<Vector2> positions = points_from("x, y", points);
    if (ids.size() != positions.size() || ids.size() != labels.size())
      throw std::invalid_argument("Stream.update: ids, positions and labels differ in length");
    const nb::gil_scoped_release release;
    const std::lock_guard lock(mutex_);
    if (closed_) throw std::invalid_argument("Stream.update: the stream is closed");
    if (ids.empty()) end_if_silent(t_s);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (const auto rejection = ingest_row({ids[i], t_s, positions[i], labels[i]}))
        ++rejected_[static_cast<std::size_t>(*rejection)];
    }
    std::vector<TrackPrediction> predictions = predict_due();
    score_due(core_, std::numeric_limits<std::size_t>::max(), settings_);
    learn_finished();
    return predictions;
  }

  /// Ends all tracks and learns them; returns when it is done.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(closed_, true)) return;
      end_stream(core_, kStream, settings_);
      learn_finished();
    }
    learner_->drain();
  }

  void wait() { learner_->wait_until_idle(); }

  StoredModel model() const {
    const std::lock_guard lock(stored_mutex_);
    return stored_;
  }

  std::string metrics() const {
    const std::lock_guard lock(mutex_);
    ServiceMetrics metrics = core_metrics(core_, *learner_, settings_);
    metrics.rejected = rejected_;
    return metrics_message(metrics);
  }

  nb::dict counts() const {
    const std::lock_guard lock(mutex_);
    const Counters& counters = core_.counters;
    const LearnerStatus learner = learner_->status();
    nb::dict counts, rejected;
    for (const RejectionText& text : kRejections) {
      const std::uint64_t count = rejected_[static_cast<std::size_t>(text.rejection)];
      if (count > 0) rejected[nb::str(text.name.data(), text.name.size())] = count;
    }
    counts["detections"] = counters.detections;
    counts["not_due"] = counters.not_due;
    counts["predictions"] = counters.predictions;
    counts["superseded"] = counters.superseded;
    counts["rejected"] = rejected;
    counts["clock_resets"] = counters.clock_resets;
    counts["tracks"] = counters.tracks;
    counts["tracks_waiting"] = learner.waiting_tracks;
    counts["tracks_learnt"] = learner.learnt_tracks;
    counts["tracks_discarded"] = learner.discarded_tracks;
    counts["episodes"] = learner.episodes;
    counts["episodes_failed"] = learner.failed_episodes;
    counts["episodes_known"] = learner.known_episodes;
    counts["last_error"] = learner.last_error;
    return counts;
  }

  /// Points on the ground [m] in the image [pixels]; NaN behind the camera.
  nb::ndarray<nb::numpy, double, nb::c_contig> image_points(nb::handle points) const {
    if (!settings_.camera) throw std::invalid_argument("Stream.to_image: the stream has no camera");
    std::vector<Vector2> result = points_from("points_m", points);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (Vector2& point : result) point = to_image(*settings_.camera, point).value_or(Vector2(nan, nan));
    return array_of_points(result);
  }

 private:
  std::optional<Rejection> ingest_row(const Detection& row) {
    if (row.track.empty() || row.track.size() > kLongestId) return Rejection::not_a_detection;
    return ingest(core_, kStream, row, 0.0, settings_).rejection;
  }

  /// Without detections the clock of the stream stands still; the time of the caller then ends the tracks.
  void end_if_silent(double t_s) {
    const auto stream = core_.streams.find(kStream);
    if (stream == core_.streams.end() || !stream->second.clock.now_s) return;
    if (t_s - *stream->second.clock.now_s >= settings_.service.silence_s) end_tracks(core_, kStream, settings_);
  }

  std::vector<TrackPrediction> predict_due() {
    const std::vector<PredictionRequest> requests = take_due_requests(core_, due_predictions(core_), settings_);
    const std::shared_ptr<const Snapshot> snapshot = learner_->snapshot();
    std::vector<TrackPrediction> predictions(requests.size());
    tbb::parallel_for(std::size_t{0}, requests.size(), [&](std::size_t i) {
      const CurbTrajectory& observed = requests[i].observed;
      predictions[i] = {requests[i].track, observed.id,
                        calibrated(snapshot->predictor.predict(observed), core_.online_calibration),
                        config_.metres_per_pixel};
    });
    for (std::size_t i = 0; i < requests.size(); ++i) retain(core_, requests[i], predictions[i].content, settings_);
    return predictions;
  }

  void learn_finished() {
    if (!core_.finished.empty()) learner_->add(std::exchange(core_.finished, {}), core_.online_calibration);
  }

  // The following two run on the learner's thread.

  void commit(const Model& previous, const Episode& episode, const OnlineCalibration& calibration) {
    EpisodeRecord record = record_of(static_cast<int>(stored_.episodes.size()) + 1, previous, episode, calibration);
    if (file_) file_->commit(episode.model, record, stored_.configuration);
    const std::lock_guard lock(stored_mutex_);
    stored_.model = episode.model;
    stored_.episodes.push_back(std::move(record));
  }

  std::optional<Model> reload() {
    if (!file_ || !file_->changed_elsewhere()) return std::nullopt;
    StoredModel changed = file_->read();
    const std::lock_guard lock(stored_mutex_);
    stored_.model = std::move(changed.model);
    stored_.episodes = std::move(changed.episodes);
    return stored_.model;
  }

  Config config_;
  StoredModel stored_;  ///< written by the learner's thread alone
  std::optional<ModelFile> file_;
  Scene scene_;
  ServiceSettings settings_;
  StreamCore core_;
  std::array<std::uint64_t, kRejections.size()> rejected_ = {};
  bool closed_ = false;
  mutable std::mutex mutex_, stored_mutex_;
  std::optional<LearnerThread> learner_;  ///< the last member: its thread uses the others
};

}  // namespace

void bind_stream(nb::module_& module) {
  nb::class_<LiveStream>(module, "LiveStream", "The service in process; sila.Stream is for users.")
      .def(nb::init<const StoredModel&, const std::optional<std::filesystem::path>&, const ScaledScene&,
                    const std::optional<std::filesystem::path>&, bool, const std::string&>(),
           "start"_a, "file"_a.none(), "scene"_a, "camera"_a.none(), "metres"_a, "config"_a)
      .def("update", &LiveStream::update, "t_s"_a, "ids"_a, "points"_a, "labels"_a,
           nb::sig("def update(self, t_s: float, ids: collections.abc.Sequence[str], points: numpy.typing.ArrayLike, "
                   "labels: collections.abc.Sequence[str]) -> list[Prediction]"))
      .def("close", &LiveStream::close, nb::call_guard<nb::gil_scoped_release>())
      .def("wait", &LiveStream::wait, nb::call_guard<nb::gil_scoped_release>())
      .def_prop_ro("model", &LiveStream::model)
      .def("metrics", &LiveStream::metrics)
      .def("counts", &LiveStream::counts, nb::sig("def counts(self) -> dict[str, typing.Any]"))
      .def("to_image", &LiveStream::image_points, "points_m"_a, nb::rv_policy::automatic,
           nb::sig("def to_image(self, points_m: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"));
}

}  // namespace sila::python
