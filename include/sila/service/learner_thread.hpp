#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sila/io/model_file.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/service/scores.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// Counts of the learner thread, since its start.
struct LearnerStatus {
  std::size_t waiting_tracks = 0;
  std::uint64_t discarded_tracks = 0;  ///< beyond service.max_waiting_tracks, or of a failed episode
  std::uint64_t episodes = 0;
  std::uint64_t failed_episodes = 0;
  std::uint64_t known_episodes = 0;  ///< batches that the model had learnt before; they change nothing
  std::uint64_t reloads = 0;         ///< of a model that another process wrote
  std::uint64_t learnt_tracks = 0;
  bool learning = false;
  double last_episode_s = 0.0;
  std::string last_error;
  std::string learning_curve;  ///< a sentence (describe_learning); empty if not known
};

/// Learns batches of tracks in a thread of its own. Predictions continue with the last snapshot until the next one is
/// complete; the learner leaves them one processor and has a lower priority. All functions may be called from any
/// thread. An episode that fails does not throw: `status` has the count and the last error.
class LearnerThread {
 public:
  /// How the model is stored. All are called on the learner's thread.
  struct Storage {
    /// Stores an episode before predictions use it (`ModelFile::commit`). If it throws, the episode counts as failed
    /// and the model does not change. If empty, the model is kept in memory only.
    std::function<void(const Model& previous, const Episode& episode, const OnlineCalibration& calibration)> commit;
    /// The stored model, if another process replaced it (`sila rollback` beside a service). Called every second, before
    /// each episode, and when a commit throws; then the episode is learnt again on the reloaded model. May be empty.
    std::function<std::optional<Model>()> reload;
    /// The learning curve of the stored episodes, for `LearnerStatus`. May be empty.
    std::function<std::string(const Model& model)> learning_curve;
    /// Tells people of a failure, or of tracks of another place, in a sentence. May be empty.
    std::function<void(const std::string& why)> failed = {};
  };

  LearnerThread(Model start, OnlineCalibration calibration, const EpisodeConfig& episode, const ServiceConfig& service,
                Storage storage);
  /// Finishes the running episode; waiting tracks are not learnt.
  ~LearnerThread();
  LearnerThread(const LearnerThread&) = delete;
  LearnerThread& operator=(const LearnerThread&) = delete;

  std::shared_ptr<const Snapshot> snapshot() const;
  LearnerStatus status() const;
  /// The calibration that is stored with the next episode.
  OnlineCalibration calibration() const;
  /// Adds tracks, and the online calibration after them; returns at once.
  void add(std::vector<FramedTrajectory> tracks, OnlineCalibration calibration);
  /// Returns when no whole batch waits and no episode runs.
  void wait_until_idle();
  /// Learns all waiting tracks, a last smaller batch included, and returns when it is done.
  void drain();

 private:
  void run();
  bool has_batch() const;
  void learn_batch(const std::vector<FramedTrajectory>& batch);
  std::optional<Episode> learn_and_commit(const std::vector<FramedTrajectory>& batch);
  bool reload_if_changed();
  std::string learning_curve(const Model& model) const;

  EpisodeConfig episode_;
  ServiceConfig service_;
  Update update_;
  Storage storage_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FramedTrajectory> waiting_;
  OnlineCalibration calibration_;
  std::shared_ptr<const Snapshot> snapshot_;
  LearnerStatus status_;
  bool stopping_ = false;
  bool draining_ = false;
  enum class Overflow { none, unreported, reported } overflow_ = Overflow::none;
  std::thread thread_;
};

/// Stores episodes in a model file, and reloads what another process stored there. The file must exist longer than the
/// learner. `start`: its content, with the configuration to store. A stored model that contradicts `config`, the
/// learner's, is not reloaded and not overwritten. `message` gets a sentence about each episode that was stored or
/// reloaded.
LearnerThread::Storage storage_in(ModelFile& file, const StoredModel& start, const EpisodeConfig& config,
                                  std::function<void(const std::string&)> message);

}  // namespace sila
