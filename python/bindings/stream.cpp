#include <limits>

#include "arrays.hpp"
#include "sila/live_stream.hpp"

namespace sila::python {
namespace {

/// sila::LiveStream with arrays of Python.
class PythonStream {
 public:
  /// `metres`: positions are metres even if the scene has a camera.
  PythonStream(const StoredModel& start, const std::optional<std::filesystem::path>& file, const DrawnScene& scene,
               const std::optional<std::filesystem::path>& camera, bool metres, const std::string& config_json)
      : config_(config_of(config_json)), live_(options(start, file, scene, camera, metres)) {}

  /// The predictions that are due after the detections of one moment, in their order. An empty label is a pedestrian.
  std::vector<TrackPrediction> update(double t_s, const std::vector<std::string>& ids, nb::handle points,
                                      const std::vector<std::string>& labels) {
    const std::vector<Vector2> positions = points_from("x, y", points);
    if (ids.size() != positions.size() || ids.size() != labels.size())
      throw std::invalid_argument("Stream.update: ids, positions and labels differ in length");
    std::vector<Detection> detections;
    for (std::size_t i = 0; i < ids.size(); ++i) detections.push_back({ids[i], t_s, positions[i], labels[i]});
    const nb::gil_scoped_release release;
    std::vector<TrackPrediction> predictions;
    for (LivePrediction& made : live_.update(t_s, detections)) {
      predictions.push_back(
          {std::move(made.track), std::move(made.tracklet), std::move(made.prediction), config_.metres_per_pixel});
    }
    return predictions;
  }

  void close() { live_.close(); }
  void wait() { live_.wait(); }
  std::vector<std::string> take_warnings() {
    std::vector<std::string> warnings = std::exchange(warnings_, {});
    std::ranges::move(live_.take_warnings(), std::back_inserter(warnings));
    return warnings;
  }
  StoredModel model() const { return live_.model(); }
  std::string metrics() const { return metrics_message(live_.metrics()); }

  nb::dict counts() const {
    const ServiceMetrics metrics = live_.metrics();
    const Counters& counters = metrics.counters;
    const LearnerStatus& learner = metrics.learner;
    nb::dict counts, rejected;
    for (const RejectionText& text : kRejections) {
      const std::uint64_t count = metrics.rejected[static_cast<std::size_t>(text.rejection)];
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
  Array image_points(nb::handle points) const {
    const Camera* const camera = live_.camera();
    if (camera == nullptr) throw std::invalid_argument("Stream.to_image: the stream has no camera");
    std::vector<Vector2> result = points_from("points_m", points);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (Vector2& point : result) point = to_image(*camera, point).value_or(Vector2(nan, nan));
    return array_of_points(result);
  }

 private:
  LiveStreamOptions options(const StoredModel& start, const std::optional<std::filesystem::path>& file,
                            const DrawnScene& drawn, const std::optional<std::filesystem::path>& camera, bool metres) {
    LiveStreamOptions options{file, start, config_, drawn.scene, {}};
    if (options.scene.camera && !camera && !metres && !pixel_camera(config_))
      throw std::invalid_argument(
          "Stream: scene has a camera: expected camera= with its file for image points, or camera=False for metres");
    if (camera) {
      CameraFile read = read_camera(*camera);
      options.camera = read.camera;
      warnings_ = std::move(read.warnings);
    }
    return options;
  }

  Config config_;
  std::vector<std::string> warnings_;  ///< about the camera, until they are taken
  LiveStream live_;
};

}  // namespace

void bind_stream(nb::module_& module) {
  nb::class_<PythonStream>(module, "LiveStream", "The service in process; sila.Stream is for users.")
      .def(nb::init<const StoredModel&, const std::optional<std::filesystem::path>&, const DrawnScene&,
                    const std::optional<std::filesystem::path>&, bool, const std::string&>(),
           "start"_a, "file"_a.none(), "scene"_a, "camera"_a.none(), "metres"_a, "config"_a)
      .def("update", &PythonStream::update, "t_s"_a, "ids"_a, "points"_a, "labels"_a,
           nb::sig("def update(self, t_s: float, ids: collections.abc.Sequence[str], points: numpy.typing.ArrayLike, "
                   "labels: collections.abc.Sequence[str]) -> list[Prediction]"))
      .def("close", &PythonStream::close, nb::call_guard<nb::gil_scoped_release>())
      .def("wait", &PythonStream::wait, nb::call_guard<nb::gil_scoped_release>())
      .def("take_warnings", &PythonStream::take_warnings)
      .def_prop_ro("model", &PythonStream::model)
      .def("metrics", &PythonStream::metrics)
      .def("counts", &PythonStream::counts, nb::sig("def counts(self) -> dict[str, typing.Any]"))
      .def("to_image", &PythonStream::image_points, "points_m"_a, nb::rv_policy::automatic,
           nb::sig("def to_image(self, points_m: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"));
}

}  // namespace sila::python
