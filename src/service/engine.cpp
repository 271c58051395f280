#include "engine.hpp"

#include <tbb/parallel_for.h>

#include <chrono>

#include "lines.hpp"
#include "live_page.hpp"
#include "sila/io/reports.hpp"

namespace sila {
namespace {

/// Predictions that are made before new detections are ingested.
constexpr std::size_t kBatchSize = 16;
/// Fewer predictions are made faster than other threads wake up.
constexpr std::size_t kMinParallel = 6;
/// Pedestrians that are scored between predictions, while none and while some are due.
constexpr std::size_t kScoredWhenIdle = 4, kScoredWhenBusy = 1;
constexpr std::chrono::milliseconds kMaxSleep(50);
/// Time for which the lines of one stream are ingested before the next stream has its turn.
constexpr double kTurn_s = 0.002;

}  // namespace

double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool Timer::has_passed(double now_s) {
  if (now_s - last_s < interval_s) return false;
  last_s = now_s;
  return true;
}

Engine::Engine(ServiceSettings settings, LearnerThread& learner, Output output, bool stepwise)
    : settings_(std::move(settings)), learner_(learner), output_(std::move(output)), stepwise_(stepwise) {
  core_.online_calibration = learner_.calibration();
  metrics_ = core_metrics(core_, learner_, settings_);
  thread_ = std::thread([this] { run(); });
}

Engine::~Engine() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Engine::offer(StreamEvent event) {
  {
    const std::lock_guard lock(mutex_);
    const auto limit = static_cast<std::size_t>(settings_.service.max_queued_lines);
    const auto own = queue_.find(event.stream);
    // A stream with less than its share of the queue is not rejected, however much the others send.
    if (event.detection && queued_ >= limit && own != queue_.end() && own->second.size() >= limit / queue_.size()) {
      count_rejection(event.stream, Rejection::overloaded);
      return;
    }
    queue_[event.stream].push_back(std::move(event));
    ++queued_;
    idle_ = false;
  }
  changed_.notify_all();
}

void Engine::reject(StreamId stream, Rejection rejection) {
  const std::lock_guard lock(mutex_);
  count_rejection(stream, rejection);
}

void Engine::count_rejection(StreamId stream, Rejection rejection) {
  ++rejected_[{stream, rejection}];
  ++rejected_total_[static_cast<std::size_t>(rejection)];
}

void Engine::drain() {
  {
    std::unique_lock lock(mutex_);
    if (stepwise_) {
      step_ = Step::requested;
      idle_ = false;
      changed_.notify_all();
    }
    changed_.wait(lock, [this] { return idle_ || stopping_; });
    step_ = Step::none;
  }
  if (stepwise_) learner_.wait_until_idle();
}

void Engine::rethrow_failure() const {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

ServiceMetrics Engine::metrics() const {
  const std::lock_guard lock(mutex_);
  return metrics_;
}

void Engine::run() {
  try {
    work();
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      stopping_ = true;
    }
    changed_.notify_all();
    if (output_.failed) output_.failed();
  }
}

void Engine::work() {
  for (bool busy = false; wait_for_work(busy);) {
    ingest_queued();
    bool may_predict = true;
    if (stepwise_) {  // a step begins when all that was offered before it is ingested
      const std::lock_guard lock(mutex_);
      may_predict = step_ == Step::running || (step_ == Step::requested && queue_.empty());
      if (may_predict) step_ = Step::running;
    }
    busy = may_predict && predict_and_score();
    end_streams();
    // In a stepwise run a new model must not come into use in the middle of a step.
    const bool may_learn = !stepwise_ || (may_predict && !busy);
    if (may_learn && !core_.finished.empty()) learner_.add(std::exchange(core_.finished, {}), core_.online_calibration);
    report(monotonic_s());
  }
}

/// Waits until there is something to do, at most `kMaxSleep`; false when the engine stops.
bool Engine::wait_for_work(bool busy) {
  std::unique_lock lock(mutex_);
  if (!busy && queue_.empty() && step_ != Step::requested) {
    idle_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, kMaxSleep, [this] { return stopping_ || !queue_.empty() || step_ == Step::requested; });
  }
  return !stopping_;
}

std::vector<StreamId> Engine::queued_streams() const {
  const std::lock_guard lock(mutex_);
  std::vector<StreamId> streams;
  for (const auto& [stream, events] : queue_) streams.push_back(stream);
  return streams;
}

bool Engine::has_queued(StreamId stream) const {
  const std::lock_guard lock(mutex_);
  return queue_.contains(stream);
}

std::optional<StreamEvent> Engine::next_event(StreamId stream) {
  const std::lock_guard lock(mutex_);
  const auto own = queue_.find(stream);
  if (own == queue_.end()) return std::nullopt;
  std::optional<StreamEvent> event = std::move(own->second.front());
  own->second.pop_front();
  if (own->second.empty()) queue_.erase(own);
  --queued_;
  return event;
}

/// Streams take turns of limited time, so that lines that are costly to ingest delay their own stream only.
void Engine::ingest_queued() {
  for (const StreamId stream : queued_streams()) {
    const double until_s = monotonic_s() + kTurn_s;
    while (const std::optional<StreamEvent> event = next_event(stream)) {
      ingest_event(*event);
      if (monotonic_s() >= until_s) break;
    }
  }
  // The result of a stepwise run must not depend on speed: while it learns no line arrives.
  if (!stepwise_) end_silent_streams(monotonic_s());
}

void Engine::ingest_event(const StreamEvent& event) {
  if (!event.detection) {
    ending_.insert(event.stream);
    if (stepwise_) end_streams();
    return;
  }
  // In a stepwise run only the time stamps show that a stream was silent. One stamp ahead by up to clock_jump_s may be
  // a wrong one; the clock of the stream waits for the next.
  constexpr double unsure_s = ServiceConfig::clock_jump_s - ServiceConfig::silence_s;
  if (stepwise_) end_if_silent(core_, event.stream, event.detection->t_s - unsure_s, settings_);
  const IngestResult result = ingest(core_, event.stream, *event.detection, event.arrived_s, settings_);
  last_arrival_s_[event.stream] = event.arrived_s;
  if (result.superseded > 0) superseded_[event.stream] += result.superseded;
  if (result.rejection) reject(event.stream, *result.rejection);
}

/// Ends the streams whose lines have ended, once their predictions are made: the client may still read. A stepwise run,
/// which predicts in steps alone, ends them at once.
void Engine::end_streams() {
  for (auto next = ending_.begin(); next != ending_.end();) {
    const StreamId id = *next;
    const auto stream = core_.streams.find(id);
    if (!stepwise_ && stream != core_.streams.end() && !stream->second.due.empty()) {
      ++next;
      continue;
    }
    report_losses();
    end_stream(core_, id, settings_);
    last_arrival_s_.erase(id);
    if (output_.ended) output_.ended(id);
    next = ending_.erase(next);
  }
}

/// A stream that still has queued lines is not silent: the engine is late.
void Engine::end_silent_streams(double now_s) {
  for (auto& [stream, last_s] : last_arrival_s_) {
    if (now_s - last_s < settings_.service.silence_s || has_queued(stream)) continue;
    end_tracks(core_, stream, settings_);
    last_s = now_s;
  }
}

/// Makes some of the due predictions and scores a few old ones; true if there is more to do.
bool Engine::predict_and_score() {
  const std::vector<PredictionRequest> requests = take_due_requests(core_, kBatchSize, settings_);
  if (!requests.empty()) send_predictions(requests);
  const std::size_t due = due_predictions(core_);
  score_due(core_, due == 0 ? kScoredWhenIdle : kScoredWhenBusy, settings_);
  return due > 0 || !core_.due_scores.empty();
}

void Engine::send_predictions(const std::vector<PredictionRequest>& requests) {
  const std::shared_ptr<const Snapshot> snapshot = learner_.snapshot();
  std::vector<Prediction> predictions(requests.size());
  std::vector<OutgoingLine> lines(requests.size());
  const Camera* const camera = settings_.camera ? &*settings_.camera : nullptr;
  const auto predict = [&](std::size_t i) {
    predictions[i] = calibrated(snapshot->predictor.predict(requests[i].observed), core_.online_calibration);
    lines[i] = {requests[i].stream,
                prediction_line(requests[i].track, predictions[i], nullptr, camera, settings_.lines), true};
  };
  if (requests.size() < kMinParallel) {
    for (std::size_t i = 0; i < requests.size(); ++i) predict(i);
  } else {
    tbb::parallel_for(std::size_t{0}, requests.size(), predict);
  }
  output_.send(std::move(lines));
  const double now_s = monotonic_s();
  for (std::size_t i = 0; i < requests.size(); ++i) {
    add(latency_, now_s - requests[i].arrived_s);
    retain(core_, requests[i], predictions[i], settings_);
  }
}

void Engine::report(double now_s) {
  for (const std::string& warning : std::exchange(core_.warnings, {})) {
    if (output_.warn) output_.warn(warning);
  }
  if (losses_timer_.has_passed(now_s)) report_losses();
  if (metrics_timer_.has_passed(now_s)) update_metrics();
  if (page_timer_.has_passed(now_s)) update_page();
}

/// Reports rejected lines and superseded predictions to their connections.
void Engine::report_losses() {
  std::map<std::pair<StreamId, Rejection>, std::size_t> rejected;
  {
    const std::lock_guard lock(mutex_);
    rejected.swap(rejected_);
  }
  std::vector<OutgoingLine> lines;
  for (const auto& [key, count] : rejected) lines.push_back({key.first, rejection_line(key.second, count), false});
  for (const auto& [stream, count] : std::exchange(superseded_, {}))
    lines.push_back({stream, dropped_line(count, "a newer detection superseded a prediction that was due"), false});
  if (!lines.empty()) output_.send(std::move(lines));
}

void Engine::update_metrics() {
  ServiceMetrics metrics = core_metrics(core_, learner_, settings_);
  metrics.latency = latency_;
  metrics.live_pages = live_pages_;
  const std::lock_guard lock(mutex_);
  metrics.rejected = rejected_total_;
  metrics.queued_lines = queued_;
  metrics_ = std::move(metrics);
}

void Engine::update_page() {
  const ServiceMetrics now = metrics();
  const int before = std::exchange(shown_episodes_, now.model_episodes);
  if (live_pages_ == 0) return;
  if (now.model_episodes != before) output_.show(model_message(learner_.snapshot()->model));
  output_.show(metrics_message(now));
  output_.show(frame_message(core_));
}

}  // namespace sila
