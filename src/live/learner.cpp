#include "sila/live/learner.hpp"

#include <sys/resource.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace sila {
namespace {

/// How much predictions go before learning where both want a processor.
constexpr int kNiceness = 10;

/// How soon the model of another party is noticed.
constexpr std::chrono::seconds kRenewEvery(1);

/// On Linux a priority belongs to a thread; elsewhere learning would slow down the whole process by it.
void give_way() {
#ifdef __linux__
  setpriority(PRIO_PROCESS, 0, kNiceness);
#endif
}

/// A model that has learnt nothing yet goes by the configuration.
Model ready_to_predict(Model model, const EpisodeConfig& config) {
  if (model.episodes == 0) model.settings.sample_interval_s = config.sampling.interval_s;
  return model;
}

}  // namespace

Learner::Learner(Model start, const EpisodeConfig& episode, const LiveConfig& live, Commit commit, Renew renew)
    : episode_(episode),
      update_(sila_update(episode)),
      live_(live),
      commit_(std::move(commit)),
      renew_(std::move(renew)),
      snapshot_(std::make_shared<const Snapshot>(ready_to_predict(std::move(start), episode), episode.predict)),
      thread_([this] { run(); }) {}

Learner::~Learner() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<const Snapshot> Learner::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

Learning Learner::learning() const {
  const std::lock_guard lock(mutex_);
  Learning now = learning_;
  now.waiting_tracks = waiting_.size();
  return now;
}

void Learner::give(std::vector<FramedTrajectory> tracks) {
  if (tracks.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    for (FramedTrajectory& track : tracks) waiting_.push_back(std::move(track));
    for (; waiting_.size() > static_cast<std::size_t>(live_.max_waiting_tracks); waiting_.pop_front())
      ++learning_.forgotten_tracks;
  }
  changed_.notify_all();
}

void Learner::learn_rest() {
  std::unique_lock lock(mutex_);
  rest_ = true;
  changed_.notify_all();
  changed_.wait(lock, [this] { return (waiting_.empty() && !learning_.busy) || stopping_; });
  rest_ = false;
}

void Learner::settle() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (!ready() && !learning_.busy) || stopping_; });
}

bool Learner::ready() const {
  return waiting_.size() >= static_cast<std::size_t>(live_.batch) || (rest_ && !waiting_.empty());
}

void Learner::run() {
  give_way();
  tbb::task_arena arena(std::max(1, tbb::this_task_arena::max_concurrency() - 1));
  std::unique_lock lock(mutex_);
  while (true) {
    const bool awaited = changed_.wait_for(lock, kRenewEvery, [this] { return stopping_ || ready(); });
    if (stopping_) return;
    if (!awaited) {
      lock.unlock();
      arena.execute([&] { take_up_changes(); });
      lock.lock();
      continue;
    }
    const std::size_t count = std::min(waiting_.size(), static_cast<std::size_t>(live_.batch));
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(count);
    std::vector<FramedTrajectory> batch(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(end));
    waiting_.erase(waiting_.begin(), end);
    learning_.busy = true;
    lock.unlock();
    arena.execute([&] { run_one(batch); });
    lock.lock();
    learning_.busy = false;
    changed_.notify_all();
  }
}

void Learner::run_one(const std::vector<FramedTrajectory>& batch) {
  try {
    take_up_changes();
    std::optional<Episode> episode = learn_and_keep(batch);
    if (!episode) {  // a recording played again
      const std::lock_guard lock(mutex_);
      ++learning_.known_episodes;
      return;
    }
    auto next = std::make_shared<const Snapshot>(std::move(episode->model), episode_.predict, *snapshot());
    const std::lock_guard lock(mutex_);
    snapshot_ = std::move(next);
    ++learning_.episodes;
    learning_.learnt_tracks += batch.size();
    learning_.last_episode_s = episode->report.seconds;
  } catch (const std::exception& error) {  // a bad batch or a full disk must not end predictions
    const std::lock_guard lock(mutex_);
    ++learning_.failed_episodes;
    learning_.forgotten_tracks += batch.size();
    learning_.last_error = error.what();
  }
}

/// The episode that was kept; nothing if the model knows the batch.
std::optional<Episode> Learner::learn_and_keep(const std::vector<FramedTrajectory>& batch) {
  while (true) {
    const std::shared_ptr<const Snapshot> previous = snapshot();
    Episode episode = run_episode(*previous, batch, episode_, update_);
    if (episode.report.known) return std::nullopt;
    try {
      commit_(previous->model, episode);
      return episode;
    } catch (const std::exception&) {
      if (!take_up_changes()) throw;
    }
  }
}

/// Whether there was a model to take up.
bool Learner::take_up_changes() {
  if (!renew_) return false;
  std::shared_ptr<const Snapshot> next;
  try {
    std::optional<Model> model = renew_();
    if (!model) return false;
    next = std::make_shared<const Snapshot>(ready_to_predict(std::move(*model), episode_), episode_.predict);
  } catch (const std::exception& error) {  // a damaged file: the next commit will say so, too
    const std::lock_guard lock(mutex_);
    learning_.last_error = error.what();
    return false;
  }
  const std::lock_guard lock(mutex_);
  snapshot_ = std::move(next);
  ++learning_.renewals;
  return true;
}

}  // namespace sila
