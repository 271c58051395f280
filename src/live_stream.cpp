#include "sila/live_stream.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <array>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "sila/service/learner_thread.hpp"
#include "sila/service/stream.hpp"
#include "sila/train/episode.hpp"

namespace sila {
namespace {

constexpr StreamId kStream = 1;
/// The stream warns when it has rejected this many detections for one reason and accepted fewer.
constexpr std::uint64_t kManyRejected = 100;

}  // namespace

struct LiveStream::State {
  std::optional<std::filesystem::path> path;
  std::optional<ModelFile> file;
  StoredModel stored;  ///< at the start; without a file with all episodes, which the learner's thread adds
  Config config;
  Scene scene;
  ServiceSettings settings;
  StreamCore core;
  std::array<std::uint64_t, kRejections.size()> rejected = {};
  bool closed = false;
  std::vector<std::string> failures;
  mutable std::mutex mutex, stored_mutex;  ///< of `core`, `rejected` and `closed`; of `stored` and `failures`
  std::optional<LearnerThread> learner;    ///< the last member: its thread uses the others

  explicit State(LiveStreamOptions options);

  void start_learner();
  std::vector<LivePrediction> predict_due();
  void learn_finished();
  void count(Rejection rejection);
};

LiveStream::State::State(LiveStreamOptions options) : path(options.file), stored(std::move(options.start)) {
  if (path) file = ModelFile::open_or_create(*path);
  if (file && !file->empty()) stored = file->read();
  config = options.config ? *options.config : config_of(stored);
  validate_fields("stream", config);
  validate(config.episode);
  const Model& model = stored.model;
  require_fitting(model, config.episode);
  require_same_units(stored, config);
  scene = std::move(options.scene);
  if (!scene.corners.empty() || !model.sites.empty()) scene = scene_for(scene, model, {}, config.corners);
  settings = {config.service,
              config.clean,
              config.episode,
              config.evaluate,
              [this](const Trajectory& track) {
                return live_frame(scene, learner->snapshot()->model, track, config.corners, config.episode.scaling);
              },
              {}};
  settings.camera = pixel_camera(config, options.camera.has_value());
  if (options.camera) settings.camera = options.camera;
  stored.configuration = to_json(config).dump();
  start_learner();
}

void LiveStream::State::start_learner() {
  core.online_calibration = calibration_in(stored);
  LearnerThread::Storage storage;
  if (file) {
    if (file->empty() && !stored.episodes.empty()) file->replace(stored);  // later episodes follow its records
    storage = storage_in(*file, stored, config.episode, [](const auto&) {});
  } else {
    storage.commit = [this](const Model& previous, const Episode& episode, const OnlineCalibration& calibration) {
      const std::lock_guard lock(stored_mutex);
      stored.model = episode.model;
      stored.episodes.push_back(record_of(last_episode(stored) + 1, previous, episode, calibration));
    };
  }
  storage.failed = [this](const std::string& why) {
    const std::lock_guard lock(stored_mutex);
    if (failures.empty() || failures.back() != why) failures.push_back(why);  // a full disk fails them all
  };
  learner.emplace(stored.model, core.online_calibration, config.episode, config.service, std::move(storage));
}

std::vector<LivePrediction> LiveStream::State::predict_due() {
  const std::vector<PredictionRequest> requests = take_due_requests(core, due_predictions(core), settings);
  const std::shared_ptr<const Snapshot> snapshot = learner->snapshot();
  std::vector<LivePrediction> predictions(requests.size());
  const auto predict = [&](std::size_t i) {
    const CurbTrajectory& observed = requests[i].observed;
    predictions[i] = {requests[i].track, observed.id,
                      calibrated(snapshot->predictor.predict(observed), core.online_calibration)};
  };
  // Isolated: a task of the caller that this thread took over while it waits could call `update`, whose mutex it holds.
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, requests.size(), predict); });
  for (std::size_t i = 0; i < requests.size(); ++i) retain(core, requests[i], predictions[i].prediction, settings);
  return predictions;
}

void LiveStream::State::learn_finished() {
  if (!core.finished.empty()) learner->add(std::exchange(core.finished, {}), core.online_calibration);
}

void LiveStream::State::count(Rejection rejection) {
  const std::uint64_t of_kind = ++rejected[static_cast<std::size_t>(rejection)];
  if (of_kind == kManyRejected && core.counters.detections < of_kind)
    core.warnings.push_back("detections accepted so far: " + std::to_string(core.counters.detections) + ", rejected: " +
                            std::to_string(of_kind) + ", because " + std::string(text_of(rejection).text));
}

LiveStream::LiveStream(LiveStreamOptions options) : state_(std::make_unique<State>(std::move(options))) {}

LiveStream::~LiveStream() = default;

std::vector<LivePrediction> LiveStream::update(double now_s, std::span<const Detection> detections) {
  const std::lock_guard lock(state_->mutex);
  if (state_->closed) throw std::invalid_argument("update: the stream is closed");
  bool silent = true;
  for (const Detection& row : detections) {
    const auto rejection = ingest(state_->core, kStream, row, 0.0, state_->settings).rejection;
    silent = silent && rejection && rejection != Rejection::off_clock;  // a wrong stamp is no silence
    if (rejection) state_->count(*rejection);
  }
  // The clock of the stream stands still meanwhile.
  if (silent) end_if_silent(state_->core, kStream, now_s, state_->settings);
  std::vector<LivePrediction> predictions = state_->predict_due();
  score_due(state_->core, std::numeric_limits<std::size_t>::max(), state_->settings);
  state_->learn_finished();
  return predictions;
}

void LiveStream::close() {
  {
    const std::lock_guard lock(state_->mutex);
    if (!std::exchange(state_->closed, true)) {
      end_stream(state_->core, kStream, state_->settings);
      state_->learn_finished();
    }
  }
  state_->learner->drain();
}

void LiveStream::wait() {
  state_->learner->wait_until_idle();
}

StoredModel LiveStream::model() const {
  if (state_->path) {
    // Before the file is read: the first episode may be stored meanwhile.
    const bool learnt = !state_->stored.episodes.empty() || state_->learner->status().episodes > 0;
    ModelFile file = ModelFile::open_or_create(*state_->path);  // the learner's thread uses the other one
    if (!file.empty()) return file.read();
    if (learnt) throw FormatError(state_->path->string(), 0, "the model of this stream", "none; the file was removed");
  }
  const std::lock_guard lock(state_->stored_mutex);
  return state_->stored;
}

std::vector<std::string> LiveStream::take_warnings() {
  const std::lock_guard lock(state_->mutex);
  std::vector<std::string> warnings = std::exchange(state_->core.warnings, {});
  const std::lock_guard failures_lock(state_->stored_mutex);
  for (std::string& failure : std::exchange(state_->failures, {})) warnings.push_back(std::move(failure));
  return warnings;
}

ServiceMetrics LiveStream::metrics() const {
  const std::lock_guard lock(state_->mutex);
  ServiceMetrics metrics = core_metrics(state_->core, *state_->learner, state_->settings);
  metrics.rejected = state_->rejected;
  return metrics;
}

const Camera* LiveStream::camera() const {
  return state_->settings.camera ? &*state_->settings.camera : nullptr;
}

}  // namespace sila
