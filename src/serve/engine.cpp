#include "sila/serve/engine.hpp"

#include <tbb/parallel_for.h>

#include <chrono>
#include <utility>

#include "sila/io/prediction_json.hpp"
#include "sila/serve/lines.hpp"
#include "sila/serve/live_page.hpp"

namespace sila {
namespace {

/// Predictions are made so many at a time; between them new detections are looked at.
constexpr std::size_t kAtATime = 16;
/// Fewer are made sooner than another thread is woken, which on a busy machine may take long.
constexpr std::size_t kWorthSharing = 6;
/// Pedestrians whose predictions are judged at a time, when no prediction waits and when one does.
constexpr std::size_t kJudgedAtLeisure = 4, kJudgedInHaste = 1;
constexpr double kTellEvery_s = 1.0, kPublishEvery_s = 0.25;
constexpr std::chrono::milliseconds kLongestSleep(50);
/// A stream is listened to for so long; then it is the next one's turn.
constexpr double kTurn_s = 0.002;

struct Answer {
  Prediction prediction;
  std::string line;
};

}  // namespace

double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Engine::Engine(LiveSettings settings, const ServeConfig& serve, Learner& learner, OnlineCalibration online_calibration,
               Outlets outlets)
    : settings_(std::move(settings)), serve_(serve), learner_(learner), outlets_(std::move(outlets)) {
  live_.online_calibration = std::move(online_calibration);
  read_core(facts_, live_, learner_, settings_);
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

void Engine::offer(Event event) {
  {
    const std::lock_guard lock(mutex_);
    const auto most = static_cast<std::size_t>(serve_.max_waiting_lines);
    const auto own = inbox_.find(event.stream);
    // Who sends little is heard, however much others send.
    if (!event.ended && inbox_size_ >= most && own != inbox_.end() && own->second.size() >= most / inbox_.size()) {
      ++refused_[{event.stream, Refusal::overloaded}];
      return;
    }
    inbox_[event.stream].push_back(std::move(event));
    ++inbox_size_;
    idle_ = false;
  }
  changed_.notify_all();
}

void Engine::refuse(StreamId stream, Refusal refusal) {
  const std::lock_guard lock(mutex_);
  ++refused_[{stream, refusal}];
}

std::size_t Engine::backlog() const {
  const std::lock_guard lock(mutex_);
  return inbox_size_ + waiting_;
}

void Engine::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return idle_ || stopping_; });
}

void Engine::go_step_by_step() {
  const std::lock_guard lock(mutex_);
  stepwise_ = held_ = true;
}

void Engine::settle() {
  {
    const std::lock_guard lock(mutex_);
    held_ = false, owed_ = true, idle_ = false;
  }
  changed_.notify_all();
  drain();
  {
    const std::lock_guard lock(mutex_);
    held_ = stepwise_;
  }
  learner_.settle();
}

Facts Engine::facts() const {
  const std::lock_guard lock(mutex_);
  return facts_;
}

void Engine::watch(std::size_t watchers) {
  const std::lock_guard lock(mutex_);
  watchers_ = watchers;
}

void Engine::run() {
  bool busy = false;
  while (true) {
    bool may_work = true, whole_steps = false;
    {
      std::unique_lock lock(mutex_);
      waiting_ = live_.queue.size();
      if (inbox_.empty() && !busy && !owed_) {
        idle_ = true;
        changed_.notify_all();
        changed_.wait_for(lock, kLongestSleep, [this] { return stopping_ || !inbox_.empty() || owed_; });
      }
      if (stopping_) return;
      // A step begins when all that was offered before it is heard.
      may_work = !held_ && (!stepwise_ || inbox_.empty()), whole_steps = stepwise_;
      if (may_work) owed_ = false;
    }
    take();
    busy = may_work && work();
    // What is learnt must not speak in the middle of a step.
    if (!live_.finished.empty() && (!whole_steps || (may_work && !busy)))
      learner_.give(std::exchange(live_.finished, {}));
    const double now_s = monotonic_s();
    if (now_s - told_s_ >= kTellEvery_s) tell_refusals(), told_s_ = now_s;
    if (now_s - published_s_ >= kPublishEvery_s) publish(), published_s_ = now_s;
    if (now_s - drawn_s_ >= serve_.page_every_s) draw(), drawn_s_ = now_s;
  }
}

std::vector<StreamId> Engine::speaking() const {
  const std::lock_guard lock(mutex_);
  std::vector<StreamId> streams;
  for (const auto& [stream, events] : inbox_) streams.push_back(stream);
  return streams;
}

std::optional<Event> Engine::next_of(StreamId stream) {
  const std::lock_guard lock(mutex_);
  const auto own = inbox_.find(stream);
  if (own == inbox_.end()) return std::nullopt;
  std::optional<Event> event = std::move(own->second.front());
  own->second.pop_front();
  if (own->second.empty()) inbox_.erase(own);
  --inbox_size_;
  return event;
}

void Engine::take(const Event& event) {
  if (event.ended) {
    end_stream(live_, event.stream, settings_);
    heard_s_.erase(event.stream), superseded_.erase(event.stream);
    return;
  }
  const Heard heard = hear(live_, event.stream, event.row, event.arrived_s, settings_);
  heard_s_[event.stream] = event.arrived_s;
  if (heard.superseded) ++superseded_[event.stream];
  if (heard.refusal) refuse(event.stream, *heard.refusal);
}

/// Listens to every stream in turn: lines that are costly to look at cost only who sends them.
void Engine::take() {
  for (const StreamId stream : speaking()) {
    const double until_s = monotonic_s() + kTurn_s;
    while (const std::optional<Event> event = next_of(stream)) {
      take(*event);
      if (monotonic_s() >= until_s) break;
    }
  }
  const double now_s = monotonic_s();
  for (auto& [stream, last_s] : heard_s_) {
    if (now_s - last_s < settings_.live.silence_s) continue;
    end_tracks(live_, stream, settings_);
    last_s = now_s;
  }
}

/// Predicts what waits longest and judges a little; says whether there is more to do.
bool Engine::work() {
  const std::vector<Question> questions = ask(live_, kAtATime, settings_);
  std::vector<Answer> answers(questions.size());
  const std::shared_ptr<const Snapshot> snapshot = learner_.snapshot();
  const auto answer = [&](std::size_t i) {
    answers[i].prediction = calibrated(snapshot->predictor.predict(questions[i].observed), live_.online_calibration);
    answers[i].line = prediction_line(questions[i].track, answers[i].prediction);
  };
  if (questions.size() < kWorthSharing) {
    for (std::size_t i = 0; i < questions.size(); ++i) answer(i);
  } else {
    tbb::parallel_for(std::size_t{0}, questions.size(), answer);
  }
  std::vector<Line> lines;
  for (std::size_t i = 0; i < questions.size(); ++i)
    lines.push_back({questions[i].stream, std::move(answers[i].line), true});
  if (!lines.empty()) outlets_.lines(std::move(lines));
  const double now_s = monotonic_s();
  for (std::size_t i = 0; i < questions.size(); ++i) {
    add(latency_, now_s - questions[i].arrived_s);
    keep(live_, questions[i], answers[i].prediction, settings_);
  }
  judge_ripe(live_, live_.queue.empty() ? kJudgedAtLeisure : kJudgedInHaste, settings_);
  return !live_.queue.empty() || !live_.ripe.empty();
}

void Engine::tell_refusals() {
  std::vector<Line> lines;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, count] : refused_) {
      lines.push_back({key.first, refusal_line(key.second, count), false});
      refused_in_all_[static_cast<std::size_t>(key.second)] += count;
    }
    refused_.clear();
  }
  for (const auto& [stream, count] : superseded_) {
    lines.push_back(
        {stream, dropped_line(count, "a newer detection took the place of a prediction that waited"), false});
  }
  superseded_.clear();
  if (!lines.empty()) outlets_.lines(std::move(lines));
}

void Engine::publish() {
  Facts facts;
  read_core(facts, live_, learner_, settings_);
  facts.latency = latency_;
  outlets_.online_calibration(live_.online_calibration);
  const std::lock_guard lock(mutex_);
  facts.refused = refused_in_all_;
  for (const auto& [key, count] : refused_) facts.refused[static_cast<std::size_t>(key.second)] += count;
  facts.waiting_lines = inbox_size_, facts.watchers = watchers_;
  facts_ = std::move(facts);
}

void Engine::draw() {
  const Facts seen = facts();
  if (seen.watchers > 0) {
    if (seen.model_episodes != drawn_episodes_) outlets_.page(model_message(learner_.snapshot()->model));
    outlets_.page(to_json(seen).dump());
    outlets_.page(frame_message(live_));
  }
  drawn_episodes_ = seen.model_episodes;
}

}  // namespace sila
