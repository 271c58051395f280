#include "sila/service/learner_thread.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "core/track_frame.hpp"
#include "service/streams.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"
#include "sila/model/packing.hpp"
#include "sila/train/episode.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

using testing::corner_walks;

/// Returns when the tracks are learnt.
void learn(LearnerThread& learner, const std::vector<FramedTrajectory>& tracks) {
  learner.add(tracks, {});
  learner.drain();
}

/// A learner with an empty model.
LearnerThread started(const ServiceConfig& config, std::function<void(const Episode&)> commit,
                      std::function<std::optional<Model>()> reload = {}) {
  return {Model{},
          {},
          EpisodeConfig{},
          config,
          {[commit = std::move(commit)](const Model&, const Episode& episode, const OnlineCalibration&) {
             commit(episode);
           },
           std::move(reload),
           {}}};
}

TEST(LearnerThread, LearnsTheEpisodesOfTheSameBatches) {
  const std::vector<FramedTrajectory> tracks = corner_walks(25, 5);
  const EpisodeConfig config;
  std::vector<int> committed;
  OnlineCalibration stored;
  LearnerThread learner(Model{}, {}, config, {.batch = 10},
                        {[&](const Model& previous, const Episode& episode, const OnlineCalibration& calibration) {
                           EXPECT_EQ(episode.model.episodes, previous.episodes + 1);
                           committed.push_back(episode.model.episodes);
                           stored = calibration;
                         },
                         {},
                         {}});
  const auto before = learner.snapshot();
  learner.add(tracks, {{1.0}, {{0.1, 0.2, 0.3, 0.4}}});
  learner.drain();
  EXPECT_EQ(committed, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(stored.horizons_s, (std::vector<double>{1.0}));
  EXPECT_TRUE(before->model.empty()) << "a snapshot does not change";
  const Training run = run_episodes(Model{}, tracks, 10, config, sila_update(config));
  const auto after = learner.snapshot();
  EXPECT_EQ(size(after->model), size(run.model));
  EXPECT_EQ(after->model.tracks, 25);
  EXPECT_EQ(learner.status().learnt_tracks, 25u);
}

TEST(LearnerThread, StatesTheLearningCurveThatTheFileGives) {
  const tests::ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10}, storage_in(file, {}, {}, [](const auto&) {}));
  EXPECT_EQ(learner.status().learning_curve, "");
  learn(learner, corner_walks(70, 5));
  const sila::StoredModel stored = file.read();
  const std::string curve = learner.status().learning_curve;
  EXPECT_TRUE(says(curve, "of constant velocity after 70 tracks"));
  EXPECT_EQ(curve, describe_learning(stored.model, learning_points(stored)));
  EXPECT_EQ(learning_json(stored)["fit"]["text"], curve);
}

TEST(LearnerThread, WithoutStorageKeepsTheModelInMemory) {
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10}, {});
  learn(learner, corner_walks(10, 5));
  EXPECT_EQ(learner.status().last_error, "");
  EXPECT_EQ(learner.snapshot()->model.tracks, 10);
}

TEST(LearnerThread, MakesTheFrameOfAModelWithoutASceneFromItsFirstBatch) {
  std::vector<FramedTrajectory> tracks = corner_walks(20, 5);
  for (FramedTrajectory& entry : tracks)
    entry.frame = live_frame({}, {}, entry.track, CornerChoice::primary, CurbScaling::metres);
  LearnerThread learner = started({.batch = 10}, [](const Episode&) {});
  learn(learner, tracks);
  const auto snapshot = learner.snapshot();
  const Model& model = snapshot->model;
  ASSERT_EQ(model.sites.size(), 1u);
  EXPECT_EQ(model.tracks, 20);
  const CurbFrame expected = frame_of_tracks(std::span(tracks).first(10));
  EXPECT_EQ(pack(model.sites[0].frame), pack(expected));
}

TEST(LearnerThread, WarnsOnceOfTracksOfAnotherPlace) {
  std::vector<std::string> warnings;
  LearnerThread::Storage storage;
  storage.failed = [&](const std::string& why) { warnings.push_back(why); };
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10}, std::move(storage));
  const auto three_km_away = [](std::vector<FramedTrajectory> tracks) {
    for (FramedTrajectory& entry : tracks) {
      for (Vector2& position_m : entry.track.positions_m) position_m.x() += 3000.0;
    }
    return tracks;
  };
  learn(learner, corner_walks(10, 1));
  EXPECT_TRUE(warnings.empty());
  for (const unsigned seed : {2U, 3U}) learn(learner, three_km_away(corner_walks(10, seed)));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(warnings.front().starts_with("the tracks lie 3.0 km from what the model has learnt")) << warnings.front();
}

TEST(LearnerThread, KeepsTheModelWhenAnEpisodeCannotBeStored) {
  int calls = 0;
  std::string message;
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10},
                        {.commit =
                             [&](const Model&, const Episode&, const OnlineCalibration&) {
                               if (++calls == 1) throw std::runtime_error("the disk is full");
                             },
                         .reload = {},
                         .learning_curve = {},
                         .failed = [&](const std::string& why) { message = why; }});
  learn(learner, corner_walks(10, 1));
  EXPECT_EQ(learner.status().failed_episodes, 1u);
  EXPECT_EQ(learner.status().last_error, "the disk is full");
  EXPECT_EQ(message, "an episode failed, and 10 tracks are lost: the disk is full");
  EXPECT_TRUE(learner.snapshot()->model.empty());
  learn(learner, corner_walks(10, 2));
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
}

TEST(LearnerThread, StoresNoEpisodeOfAKnownBatch) {
  int calls = 0;
  LearnerThread learner = started({.batch = 10}, [&](const Episode&) { ++calls; });
  for (int i = 0; i < 2; ++i) learn(learner, corner_walks(10, 1));
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
  EXPECT_EQ(learner.status().episodes, 1u);
  EXPECT_EQ(learner.status().known_episodes, 1u);
  EXPECT_EQ(learner.status().learnt_tracks, 10u);
}

/// A stored model that another process may change: a model file with its revision, without a disk.
struct StoredModel {
  std::mutex mutex;
  Model model;
  bool changed = false;

  void replace(Model other) {
    const std::lock_guard lock(mutex);
    model = std::move(other);
    changed = true;
  }
  void commit(const Episode& episode) {
    const std::lock_guard lock(mutex);
    if (changed) throw std::runtime_error("another process changed it");
    model = episode.model;
  }
  std::optional<Model> reload() {
    const std::lock_guard lock(mutex);
    return std::exchange(changed, false) ? std::optional<Model>(model) : std::nullopt;
  }
};

TEST(LearnerThread, ReloadsAModelThatAnotherProcessReplaced) {
  StoredModel stored;
  LearnerThread learner = started(
      {.batch = 10}, [&](const Episode& episode) { stored.commit(episode); }, [&] { return stored.reload(); });
  learn(learner, corner_walks(10, 1));
  ASSERT_EQ(learner.snapshot()->model.episodes, 1);
  stored.replace(Model{});  // rolled back
  testing::comes_true([&] { return learner.status().reloads > 0; });
  EXPECT_EQ(learner.status().reloads, 1u);
  EXPECT_TRUE(learner.snapshot()->model.empty());
}

TEST(LearnerThread, TakesNoModelThatContradictsItsConfiguration) {
  Model other;
  other.episodes = 1;
  other.settings.sample_interval_s = 0.1;
  EXPECT_THROW(LearnerThread(other, {}, EpisodeConfig{}, {.batch = 10}, {}), std::invalid_argument);
  const tests::ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10}, storage_in(file, {}, {}, [](const auto&) {}));
  sila::StoredModel stored;
  stored.model = other;
  save_model(folder / "m.sila", stored);
  testing::comes_true([&] { return !learner.status().last_error.empty(); });
  EXPECT_TRUE(says(learner.status().last_error, "sampling.interval_s"));
  EXPECT_EQ(learner.status().reloads, 0u);
  EXPECT_EQ(learner.snapshot()->model.episodes, 0);
  learn(learner, corner_walks(10, 1));
  EXPECT_EQ(learner.status().failed_episodes, 1u);
  EXPECT_EQ(load_model(folder / "m.sila").model.settings.sample_interval_s, 0.1) << "it is not overwritten";
}

TEST(LearnerThread, TakesNoModelThatLacksItsSite) {
  const tests::ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, {.batch = 10}, storage_in(file, {}, {}, [](const auto&) {}));
  learn(learner, corner_walks(10, 1));
  sila::StoredModel elsewhere;
  elsewhere.model = run_episode({}, testing::walks_at(make_curb_frame({90, 0}, {0, 1}, {-1, 0}, 2.5), 10, 2), {}).model;
  save_model(folder / "m.sila", elsewhere);
  testing::comes_true([&] { return !learner.status().last_error.empty(); });
  EXPECT_TRUE(says(learner.status().last_error, "lacks a site"));
  EXPECT_EQ(learner.status().reloads, 0u);
  learn(learner, corner_walks(10, 3));
  EXPECT_EQ(learner.status().failed_episodes, 1u);
  EXPECT_EQ(load_model(folder / "m.sila").model.sites.size(), 1u) << "it is not overwritten";
}

TEST(LearnerThread, LearnsAgainWhenAnotherProcessReplacedTheModel) {
  StoredModel stored;
  bool first = true;
  LearnerThread learner = started(
      {.batch = 10},
      [&](const Episode& episode) {
        if (std::exchange(first, false))  // between learning and storing
          stored.replace(run_episode(Model{}, corner_walks(10, 2), EpisodeConfig{}).model);
        stored.commit(episode);
      },
      [&] { return stored.reload(); });
  learn(learner, corner_walks(10, 1));
  EXPECT_EQ(learner.status().failed_episodes, 0u);
  EXPECT_EQ(learner.status().discarded_tracks, 0u);
  EXPECT_EQ(learner.status().reloads, 1u);
  EXPECT_EQ(stored.model.episodes, 2) << "one of the other process, one learnt again on it";
  EXPECT_EQ(learner.snapshot()->model.tracks, 20);
}

TEST(LearnerThread, GoesOnWhenTheStoredModelCannotBeRead) {
  LearnerThread learner = started(
      {.batch = 10}, [](const Episode&) {},
      []() -> std::optional<Model> { throw std::runtime_error("the file is damaged"); });
  learn(learner, corner_walks(10, 1));
  EXPECT_EQ(learner.status().last_error, "the file is damaged");
  EXPECT_EQ(learner.snapshot()->model.episodes, 1);
}

TEST(LearnerThread, DiscardsTheOldestTracksWhenTooManyWait) {
  const ServiceConfig config{.batch = 20, .max_waiting_tracks = 10};
  std::atomic<bool> learns = false, released = false;
  std::atomic<int> warnings = 0;
  const auto hold = [&](const Model&, const Episode&, const OnlineCalibration&) {
    learns = true;
    learns.notify_one();
    released.wait(false);
  };
  LearnerThread learner(Model{}, {}, EpisodeConfig{}, config, {hold, {}, {}, [&](const std::string&) { ++warnings; }});
  learner.add(corner_walks(20, 1), {});
  learns.wait(false);
  for (unsigned seed = 2; seed <= 11; ++seed) learner.add(corner_walks(10, seed), {});
  EXPECT_EQ(learner.status().waiting_tracks, 30u) << "a batch, and those that wait beside it";
  EXPECT_EQ(learner.status().discarded_tracks, 70u);
  released = true;
  released.notify_one();
  learner.drain();
  EXPECT_EQ(warnings, 1);
  std::vector<FramedTrajectory> kept = corner_walks(10, 9);
  std::ranges::move(corner_walks(10, 10), std::back_inserter(kept));
  std::vector<EpisodeId> expected{episode_id(corner_walks(20, 1)), episode_id(kept), episode_id(corner_walks(10, 11))};
  std::ranges::sort(expected);
  EXPECT_EQ(learner.snapshot()->model.episode_ids, expected) << "of the first batch and the newest tracks";
}

TEST(LearnerThread, EndsWithoutLearningAPartialBatch) {
  int calls = 0;
  {
    LearnerThread learner = started({.batch = 20}, [&](const Episode&) { ++calls; });
    learner.add(corner_walks(5, 1), {});
  }
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace sila
