#include "sila/service/learner_thread.hpp"

#include <sys/resource.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <utility>

#include "core/track_frame.hpp"
#include "sila/core/counted.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"

namespace sila {
namespace {

/// Priority of learning below that of predictions.
constexpr int kNiceness = 10;

constexpr std::chrono::seconds kReloadInterval(1);

/// On Linux a priority belongs to a thread; elsewhere it would slow down the whole process.
void lower_priority() {
#ifdef __linux__
  setpriority(PRIO_PROCESS, 0, kNiceness);
#endif
}

/// An empty model takes the sample interval of the configuration.
Model ready_to_predict(Model model, const EpisodeConfig& config) {
  require_fitting(model, config);
  if (model.episodes == 0) model.settings.sample_interval_s = config.sampling.interval_s;
  return model;
}

/// Puts tracks that came before the model had a frame (no scene file) in the frame of the model; for its first batch in
/// a frame made from the batch.
std::vector<FramedTrajectory> placed_for(const Model& model, std::vector<FramedTrajectory> batch, CurbScaling scaling) {
  if (batch.empty() || !batch.front().frame.from_tracks) return batch;
  const CurbFrame frame = frame_from_tracks(model).value_or(rescaled(frame_of_tracks(batch), scaling));
  for (FramedTrajectory& entry : batch) {
    if (entry.frame.from_tracks) entry.frame = frame;
  }
  return batch;
}

}  // namespace

LearnerThread::Storage storage_in(ModelFile& file, const StoredModel& start, const EpisodeConfig& config,
                                  std::function<void(const std::string&)> message) {
  struct Recorded {
    int last;
    std::vector<LearningPoint> points;
    std::vector<Site> sites;
  };
  const auto recorded =
      std::make_shared<Recorded>(Recorded{last_episode(start), learning_points(start), start.model.sites});
  const std::string configuration = start.configuration;
  const auto accept = [config, recorded](const StoredModel& stored) {
    require_fitting(stored.model, config);
    const std::vector<Site>& sites = stored.model.sites;
    const auto has = [&](const Site& site) { return find_site(sites, site.frame).has_value(); };
    if (!sites.empty() && !std::ranges::all_of(recorded->sites, has))  // open tracks are in the frames of the sites
      throw std::invalid_argument("the model in the file lacks a site of the model in use; to use it, start again");
  };
  LearnerThread::Storage storage;
  storage.commit = [=, &file](const Model& previous, const Episode& episode, const OnlineCalibration& calibration) {
    file.commit(episode.model, record_of(recorded->last + 1, previous, episode, calibration), configuration);
    recorded->sites = episode.model.sites;
    if (previous.tracks > 0)
      recorded->points.push_back({static_cast<double>(previous.tracks), episode.report.prequential});
    message("episode " + std::to_string(++recorded->last) + " is stored: " + counted(episode.report.tracks, "track") +
            ", size " + std::to_string(episode.report.size_before) + " -> " +
            std::to_string(episode.report.size_after));
  };
  storage.reload = [=, &file]() -> std::optional<Model> {
    if (!file.changed_elsewhere()) return std::nullopt;
    StoredModel stored = file.read(accept);  // else the next episode would replace a model that does not fit
    *recorded = {last_episode(stored), learning_points(stored), stored.model.sites};
    message("changed by another process; continuing with its " + counted(recorded->last, "episode"));
    return std::move(stored.model);
  };
  storage.learning_curve = [=](const Model& model) { return describe_learning(model, recorded->points); };
  storage.failed = std::move(message);
  return storage;
}

LearnerThread::LearnerThread(Model start, OnlineCalibration calibration, const EpisodeConfig& episode,
                             const ServiceConfig& service, Storage storage)
    : episode_(episode),
      service_(service),
      update_(sila_update(episode)),
      storage_(std::move(storage)),
      calibration_(std::move(calibration)),
      snapshot_(std::make_shared<const Snapshot>(ready_to_predict(std::move(start), episode), episode.predict)) {
  status_.learning_curve = learning_curve(snapshot_->model);
  thread_ = std::thread([this] { run(); });
}

LearnerThread::~LearnerThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<const Snapshot> LearnerThread::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

LearnerStatus LearnerThread::status() const {
  const std::lock_guard lock(mutex_);
  LearnerStatus status = status_;
  status.waiting_tracks = waiting_.size();
  return status;
}

OnlineCalibration LearnerThread::calibration() const {
  const std::lock_guard lock(mutex_);
  return calibration_;
}

void LearnerThread::add(std::vector<FramedTrajectory> tracks, OnlineCalibration calibration) {
  const std::lock_guard lock(mutex_);
  calibration_ = std::move(calibration);
  for (FramedTrajectory& track : tracks) waiting_.push_back(std::move(track));
  const auto most = static_cast<std::size_t>(service_.batch) + static_cast<std::size_t>(service_.max_waiting_tracks);
  for (; waiting_.size() > most; waiting_.pop_front()) {
    ++status_.discarded_tracks;
    if (overflow_ == Overflow::none) overflow_ = Overflow::unreported;
  }
  changed_.notify_all();
}

void LearnerThread::wait_until_idle() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (!has_batch() && !status_.learning) || stopping_; });
}

void LearnerThread::drain() {
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
  }
  changed_.notify_all();
  wait_until_idle();
  const std::lock_guard lock(mutex_);
  draining_ = false;
}

bool LearnerThread::has_batch() const {
  return waiting_.size() >= static_cast<std::size_t>(service_.batch) || (draining_ && !waiting_.empty());
}

void LearnerThread::run() {
  lower_priority();
  tbb::task_arena arena(std::max(1, tbb::this_task_arena::max_concurrency() - 1));
  std::unique_lock lock(mutex_);
  while (true) {
    const bool ready = changed_.wait_for(lock, kReloadInterval, [this] { return stopping_ || has_batch(); });
    if (stopping_) return;
    std::vector<FramedTrajectory> batch;
    if (ready) {
      const std::size_t count = std::min(waiting_.size(), static_cast<std::size_t>(service_.batch));
      const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(count);
      batch.assign(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(end));
      waiting_.erase(waiting_.begin(), end);
    }
    status_.learning = ready;
    const bool reports = overflow_ == Overflow::unreported;
    if (reports) overflow_ = Overflow::reported;
    lock.unlock();
    if (reports && storage_.failed)
      storage_.failed("tracks end faster than they are learnt: the oldest of those that wait are lost");
    arena.execute([&] {
      reload_if_changed();
      if (ready) learn_batch(batch);
    });
    lock.lock();
    status_.learning = false;
    changed_.notify_all();
  }
}

void LearnerThread::learn_batch(const std::vector<FramedTrajectory>& batch) {
  try {
    std::optional<Episode> episode = learn_and_commit(batch);
    if (!episode) {
      const std::lock_guard lock(mutex_);
      ++status_.known_episodes;
      return;
    }
    auto next = std::make_shared<const Snapshot>(std::move(episode->model), episode_.predict, snapshot().get());
    std::string curve = learning_curve(next->model);
    const std::lock_guard lock(mutex_);
    snapshot_ = std::move(next);
    status_.learning_curve = std::move(curve);
    ++status_.episodes;
    status_.learnt_tracks += batch.size();
    status_.last_episode_s = episode->report.seconds;
  } catch (const std::exception& error) {  // a bad batch or a full disk must not end predictions
    {
      const std::lock_guard lock(mutex_);
      ++status_.failed_episodes;
      status_.discarded_tracks += batch.size();
      status_.last_error = error.what();
    }
    if (storage_.failed)
      storage_.failed("an episode failed, and " + counted(batch.size(), "track") + " are lost: " + error.what());
  }
}

/// The stored episode; none if the model knows the batch, as when a recording is played again.
std::optional<Episode> LearnerThread::learn_and_commit(const std::vector<FramedTrajectory>& batch) {
  while (true) {
    const std::shared_ptr<const Snapshot> previous = snapshot();
    const std::vector<FramedTrajectory> placed = placed_for(previous->model, batch, episode_.scaling);
    Episode episode = run_episode(previous->model, placed, episode_, update_, &previous->predictor);
    if (episode.report.known) return std::nullopt;
    const std::string warning = warning_of_another_place(previous->model, placed);
    if (!warning.empty() && storage_.failed) storage_.failed(warning);  // once: then the model knows the place
    try {
      if (storage_.commit) storage_.commit(previous->model, episode, calibration());
      return episode;
    } catch (const std::exception&) {
      if (!reload_if_changed()) throw;
    }
  }
}

/// True if there was a changed model.
bool LearnerThread::reload_if_changed() {
  if (!storage_.reload) return false;
  std::shared_ptr<const Snapshot> next;
  std::string curve;
  try {
    std::optional<Model> model = storage_.reload();
    if (!model) return false;
    next = std::make_shared<const Snapshot>(ready_to_predict(std::move(*model), episode_), episode_.predict);
    curve = learning_curve(next->model);
  } catch (const std::exception& error) {  // a damaged file, or one that does not fit: the next commit fails as well
    std::unique_lock lock(mutex_);
    const bool known = std::exchange(status_.last_error, error.what()) == error.what();
    lock.unlock();
    if (!known && storage_.failed)
      storage_.failed(std::string("changed by another process, and not used: ") + error.what());
    return false;
  }
  const std::lock_guard lock(mutex_);
  snapshot_ = std::move(next);
  status_.learning_curve = std::move(curve);
  ++status_.reloads;
  return true;
}

std::string LearnerThread::learning_curve(const Model& model) const {
  return storage_.learning_curve ? storage_.learning_curve(model) : std::string();
}

}  // namespace sila
