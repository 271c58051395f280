#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sila/live/config.hpp"
#include "sila/refine/snapshot.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// Where learning stands.
struct Learning {
  std::size_t waiting_tracks = 0;
  std::uint64_t forgotten_tracks = 0;  ///< more than live.max_waiting_tracks waited, or their episode failed
  std::uint64_t episodes = 0;          ///< since the start
  std::uint64_t failed_episodes = 0;
  std::uint64_t known_episodes = 0;  ///< batches that the model had learnt before: nothing was done
  std::uint64_t renewals = 0;        ///< models that another process wrote and the learner loaded
  std::uint64_t learnt_tracks = 0;
  bool busy = false;
  double last_episode_s = 0.0;
  std::string last_error;
};

/// Learns in a thread of its own, one batch an episode. Predictions never wait for it: they go on with the last
/// snapshot until the next one is whole, and it leaves them all processors but one.
class Learner {
 public:
  /// Called on the learner's thread with the model before and each episode that learnt something, before anybody
  /// predicts with it; keeps it (`ModelFile::commit`). If it throws, the episode counts as failed and the model stays
  /// what it was.
  using Commit = std::function<void(const Model& previous, const Episode& episode)>;

  /// Called on the learner's thread every second, before each episode, and when one could not be kept: the model that
  /// another party put in the place of the kept one (`sila rollback` beside a service), if so. It is predicted with
  /// and learnt on from then on; an episode that could not be kept for it is learnt again.
  using Renew = std::function<std::optional<Model>()>;

  Learner(Model start, const EpisodeConfig& episode, const LiveConfig& live, Commit commit, Renew renew = {});
  /// Finishes the episode that runs; what waits is not learnt.
  ~Learner();
  Learner(const Learner&) = delete;
  Learner& operator=(const Learner&) = delete;

  std::shared_ptr<const Snapshot> snapshot() const;
  Learning learning() const;
  /// Hands over tracks; returns at once.
  void give(std::vector<FramedTrajectory> tracks);
  /// Learns what waits, a last smaller batch included, and returns when it is done.
  void learn_rest();
  /// Returns when no whole batch waits any more and none is being learnt.
  void settle();

 private:
  void run();
  void run_one(const std::vector<FramedTrajectory>& batch);
  std::optional<Episode> learn_and_keep(const std::vector<FramedTrajectory>& batch);
  bool take_up_changes();
  bool ready() const;

  EpisodeConfig episode_;
  Update update_;
  LiveConfig live_;
  Commit commit_;
  Renew renew_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FramedTrajectory> waiting_;
  std::shared_ptr<const Snapshot> snapshot_;
  Learning learning_;
  bool stopping_ = false;
  bool rest_ = false;
  std::thread thread_;
};

}  // namespace sila
