#include "sila/live/learner.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "live/streams.hpp"
#include "sila/train/training.hpp"

namespace sila {
namespace {

using testing::corner_walks;

LiveConfig small_batches(int batch) {
  LiveConfig config;
  config.batch = batch;
  return config;
}

TEST(Learner, LearnsAsTheEpisodesOfTheSameBatchesDo) {
  const std::vector<FramedTrajectory> tracks = corner_walks(25, 5);
  const EpisodeConfig config;
  std::vector<int> committed;
  Learner learner(Model{}, config, small_batches(10), [&](const Model& previous, const Episode& episode) {
    EXPECT_EQ(episode.model.episodes, previous.episodes + 1);
    committed.push_back(episode.model.episodes);
  });
  const auto before = learner.snapshot();
  learner.give(tracks);
  learner.learn_rest();
  EXPECT_EQ(committed, (std::vector<int>{1, 2, 3}));
  EXPECT_TRUE(before->model.empty()) << "a snapshot never changes";
  const Training run = run_episodes(Model{}, tracks, 10, config, sila_update(config));
  const auto after = learner.snapshot();
  EXPECT_EQ(size(after->model), size(run.model));
  EXPECT_EQ(after->model.tracks, 25);
  EXPECT_EQ(learner.learning().learnt_tracks, 25u);
}

TEST(Learner, GoesOnWithTheModelThatItHadWhenItCannotBeKept) {
  int calls = 0;
  Learner learner(Model{}, EpisodeConfig{}, small_batches(10), [&](const Model&, const Episode&) {
    if (++calls == 1) throw std::runtime_error("the disk is full");
  });
  learner.give(corner_walks(10, 1));
  learner.learn_rest();
  EXPECT_EQ(learner.learning().failed_episodes, 1u);
  EXPECT_EQ(learner.learning().last_error, "the disk is full");
  EXPECT_TRUE(learner.snapshot()->model.empty());
  learner.give(corner_walks(10, 2));
  learner.learn_rest();
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
}

TEST(Learner, KeepsNoEpisodeOfABatchThatIsKnown) {
  int calls = 0;
  Learner learner(Model{}, EpisodeConfig{}, small_batches(10), [&](const Model&, const Episode&) { ++calls; });
  for (int i = 0; i < 2; ++i) {
    learner.give(corner_walks(10, 1));
    learner.learn_rest();
  }
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
  EXPECT_EQ(learner.learning().episodes, 1u);
  EXPECT_EQ(learner.learning().known_episodes, 1u);
  EXPECT_EQ(learner.learning().learnt_tracks, 10u);
}

/// A kept model that another party may change: as a model file with its revision, without a disk.
struct KeptModel {
  std::mutex mutex;
  Model model;
  bool changed = false;

  void put(Model other) {
    const std::lock_guard lock(mutex);
    model = std::move(other), changed = true;
  }
  void commit(const Episode& episode) {
    const std::lock_guard lock(mutex);
    if (changed) throw std::runtime_error("another process changed it");
    model = episode.model;
  }
  std::optional<Model> renewed() {
    const std::lock_guard lock(mutex);
    return std::exchange(changed, false) ? std::optional<Model>(model) : std::nullopt;
  }
};

TEST(Learner, TakesUpWithinSecondsWhatSomebodyElseKept) {
  KeptModel kept;
  Learner learner(
      Model{}, EpisodeConfig{}, small_batches(10), [&](const Model&, const Episode& episode) { kept.commit(episode); },
      [&] { return kept.renewed(); });
  learner.give(corner_walks(10, 1));
  learner.learn_rest();
  ASSERT_EQ(learner.snapshot()->model.episodes, 1);
  kept.put(Model{});  // rolled back
  for (int i = 0; i < 200 && learner.learning().renewals == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(learner.learning().renewals, 1u);
  EXPECT_TRUE(learner.snapshot()->model.empty());
}

TEST(Learner, LearnsAgainWhatCouldNotBeKeptBecauseOfSomebodyElse) {
  KeptModel kept;
  bool first = true;
  Learner learner(
      Model{}, EpisodeConfig{}, small_batches(10),
      [&](const Model&, const Episode& episode) {
        if (std::exchange(first, false)) {  // between learning and keeping
          Model other = run_episode(Model{}, corner_walks(10, 2), EpisodeConfig{}).model;
          kept.put(std::move(other));
        }
        kept.commit(episode);
      },
      [&] { return kept.renewed(); });
  learner.give(corner_walks(10, 1));
  learner.learn_rest();
  EXPECT_EQ(learner.learning().failed_episodes, 0u);
  EXPECT_EQ(learner.learning().forgotten_tracks, 0u);
  EXPECT_EQ(learner.learning().renewals, 1u);
  EXPECT_EQ(kept.model.episodes, 2) << "the other's, and the one learnt again on it";
  EXPECT_EQ(learner.snapshot()->model.tracks, 20);
}

TEST(Learner, GoesOnWhenTheKeptModelCannotBeRead) {
  Learner learner(
      Model{}, EpisodeConfig{}, small_batches(10), [](const Model&, const Episode&) {},
      []() -> std::optional<Model> { throw std::runtime_error("the file is damaged"); });
  learner.give(corner_walks(10, 1));
  learner.learn_rest();
  EXPECT_EQ(learner.learning().last_error, "the file is damaged");
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
}

TEST(Learner, ForgetsTheOldestTracksWhenTooManyWait) {
  LiveConfig config = small_batches(1000);
  config.max_waiting_tracks = 30;
  Learner learner(Model{}, EpisodeConfig{}, config, [](const Model&, const Episode&) {});
  for (int i = 0; i < 10; ++i) learner.give(corner_walks(10, 1));
  EXPECT_EQ(learner.learning().waiting_tracks, 30u);
  EXPECT_EQ(learner.learning().forgotten_tracks, 70u);
}

TEST(Learner, EndsWithoutLearningWhatIsLessThanABatch) {
  int calls = 0;
  {
    Learner learner(Model{}, EpisodeConfig{}, small_batches(20), [&](const Model&, const Episode&) { ++calls; });
    learner.give(corner_walks(5, 1));
  }
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace sila
