#include "sila/train/training.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

namespace sila {
namespace {

/// Batch learning takes no error statistics on the way and has no growth to stop.
EpisodeConfig plain_config(EpisodeConfig config) {
  config.error_statistics.enabled = false;
  config.compact.enabled = false;
  return config;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Predicts by the model of the last episode, and keeps for the next what stays as it is.
class Follower {
 public:
  /// Nothing if there is nothing to take error statistics on, or if all of the model fades before it.
  const Predictor* follow(const Model& model, const EpisodeConfig& config) {
    if (!config.error_statistics.enabled || model.episodes == 0 || std::isfinite(config.compact.half_life_episodes))
      return nullptr;
    if (!predictor_) {
      predictor_.emplace(model, config.predict);
    } else if (left_behind_) {
      predictor_ = Predictor(model, config.predict, *left_behind_, *predictor_);
    }
    left_behind_.reset();
    return &*predictor_;
  }

  /// The model that was followed is now another one.
  void leave_behind(Model model) {
    if (predictor_) left_behind_ = std::move(model);
  }

 private:
  std::optional<Predictor> predictor_;
  std::optional<Model> left_behind_;
};

}  // namespace

BatchCounts run_batches(Model& model, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                        const EpisodeObserver& observer) {
  BatchCounts counts;
  Follower follower;
  for (std::span<const FramedTrajectory> batch = next_batch(); !batch.empty(); batch = next_batch()) {
    const auto start = std::chrono::steady_clock::now();
    const Predictor* const ready = follower.follow(model, config);
    const double making_ready_s = seconds_since(start);
    Episode episode = run_episode(model, batch, config, update, ready);
    episode.report.seconds += making_ready_s;
    if (episode.report.known) {
      ++counts.known;
      continue;
    }
    ++counts.learnt;
    if (observer) observer(counts.learnt, episode);
    follower.leave_behind(std::exchange(model, std::move(episode.model)));
  }
  return counts;
}

Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer) {
  if (batch_size == 0) throw std::invalid_argument("run_episodes: batch_size = 0, must be at least 1");
  Training run{start, {}, 0};
  const auto next_batch = [&, left = tracks]() mutable {
    const auto batch = left.first(std::min(batch_size, left.size()));
    left = left.subspan(batch.size());
    return batch;
  };
  const auto keep = [&](int number, const Episode& episode) {
    run.episodes.push_back(episode.report);
    if (observer) observer(number, episode);
  };
  run.known = run_batches(run.model, next_batch, config, update, keep).known;
  return run;
}

Training train_batch(std::span<const FramedTrajectory> tracks, const EpisodeConfig& config) {
  const auto started = std::chrono::steady_clock::now();
  const auto half = tracks.size() / 2;
  const EpisodeConfig plain = plain_config(config);
  const auto learn_all = [&](std::span<const FramedTrajectory> some) {
    return run_episode(Model{}, some, plain, sila_update(plain));
  };
  Episode whole = learn_all(tracks);
  if (config.error_statistics.enabled && half > 0) {
    const Model first = learn_all(tracks.first(half)).model, second = learn_all(tracks.subspan(half)).model;
    whole.model.sites =
        join_sites(std::move(whole.model.sites), error_statistics_on(first, tracks.subspan(half), config)).sites;
    whole.model.sites =
        join_sites(std::move(whole.model.sites), error_statistics_on(second, tracks.first(half), config)).sites;
  }
  whole.report.seconds = seconds_since(started);
  return {std::move(whole.model), {whole.report}, 0};
}

}  // namespace sila
