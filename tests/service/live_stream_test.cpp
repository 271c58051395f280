#include "sila/live_stream.hpp"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <limits>
#include <thread>

#include "service/streams.hpp"
#include "sila/core/errors.hpp"
#include "sila/train/episode.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

using testing::corner_walks;
using testing::paths_of;
using testing::stream_of;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Config small_batches() {
  Config config;
  config.service.batch = 10;
  return config;
}

/// Feeds one walk after the other, and waits for learning after each detection.
std::vector<LivePrediction> feed(LiveStream& stream, const std::vector<FramedTrajectory>& tracks) {
  std::vector<LivePrediction> all;
  for (const Detection& row : stream_of(paths_of(tracks), 30.0)) {
    for (LivePrediction& made : stream.update(row.t_s, std::span(&row, 1))) all.push_back(std::move(made));
    stream.wait();
  }
  return all;
}

TEST(LiveStream, ContinuesItsModelFileWithTheConfigurationOfTheModel) {
  const tests::ScratchFolder folder;
  const std::filesystem::path file = folder / "m.sila";
  Config config = small_batches();
  config.episode.predict.horizon_s = 3.0;
  {
    LiveStream stream({.file = file, .config = config});
    feed(stream, corner_walks(10, 5));
    stream.close();
    EXPECT_THROW(stream.update(0.0, {}), std::invalid_argument);
  }
  EXPECT_EQ(load_model(file).model.tracks, 10);
  LiveStream again({.file = file});
  const std::vector<LivePrediction> predictions = feed(again, corner_walks(10, 6));
  again.close();
  EXPECT_EQ(again.metrics().learner.last_error, "");
  EXPECT_EQ(again.model().model.tracks, 20);
  EXPECT_EQ(load_model(file).episodes.size(), 2u);
  ASSERT_FALSE(predictions.empty());
  EXPECT_NEAR(predictions.back().prediction.times_s.back(), 3.0, 1e-9);
  config.metres_per_pixel = 0.02;
  EXPECT_THROW(LiveStream({.file = file, .config = config}), std::invalid_argument);
}

TEST(LiveStream, EpisodesFollowTheLastRecordOfItsStart) {
  const tests::ScratchFolder folder;
  const auto numbers = [](const StoredModel& stored) {
    std::vector<int> result;
    for (const EpisodeRecord& episode : stored.episodes) result.push_back(episode.number);
    return result;
  };
  const auto continued = [&](LiveStreamOptions options, unsigned seed) {
    LiveStream stream(std::move(options));
    feed(stream, corner_walks(10, seed));
    stream.close();
    EXPECT_EQ(stream.metrics().learner.last_error, "");
    return stream.model();
  };
  StoredModel start = continued({.start = continued({.config = small_batches()}, 5)}, 6);
  start.episodes.erase(start.episodes.begin());
  ASSERT_EQ(numbers(start), (std::vector{2}));
  EXPECT_EQ(numbers(continued({.start = start}, 7)), (std::vector{2, 3}));
  EXPECT_EQ(numbers(continued({.file = folder / "m.sila", .start = start}, 7)), (std::vector{2, 3}));
  EXPECT_EQ(numbers(continued({.file = folder / "m.sila"}, 8)), (std::vector{2, 3, 4}));
}

TEST(LiveStream, RejectsFaultyDetectionsAndCountsThem) {
  LiveStream stream({});
  const Detection good{"a", 1.0, {0.0, 0.0}};
  std::vector<Detection> rows(6, good);
  rows[1].position_m.x() = kNaN;
  rows[2].t_s = kNaN;
  rows[3].track = "";
  rows[4].track = std::string(kMaxIdBytes + 1, 'x');
  rows[5].t_s = -3600.0;
  EXPECT_TRUE(stream.update(1.0, rows).empty());
  const ServiceMetrics metrics = stream.metrics();
  EXPECT_EQ(metrics.counters.detections, 1u);
  const auto rejected = [&](Rejection reason) { return metrics.rejected[static_cast<std::size_t>(reason)]; };
  EXPECT_EQ(rejected(Rejection::not_usable), 2u);
  EXPECT_EQ(rejected(Rejection::not_a_detection), 2u);
  EXPECT_EQ(rejected(Rejection::off_clock), 1u);
}

TEST(LiveStream, WarnsOnceIfNothingIsAccepted) {
  LiveStream stream({});
  const std::vector<Detection> cars(60, {"a", 1.0, {0.0, 0.0}, "Car"});
  stream.update(1.0, cars);
  EXPECT_TRUE(stream.take_warnings().empty());
  stream.update(1.1, cars);
  const std::vector<std::string> warnings = stream.take_warnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(says(warnings[0], "accepted so far: 0")) << warnings[0];
  const Detection person{"b", 1.0, {0.0, 0.0}, "0"};
  stream.update(1.2, std::span(&person, 1));
  EXPECT_EQ(stream.metrics().counters.detections, 1u) << "0 is a person, as in lines of detections";
}

TEST(LiveStream, WarnsOnceOfAClockInMilliseconds) {
  for (const double start : {0.0, 1.7e12}) {
    LiveStream stream({});
    for (int k = 0; k < 200; ++k) {
      const Detection row{"a", start + 100.0 * k, {0.1 * k, 0.0}};
      stream.update(row.t_s, std::span(&row, 1));
    }
    const std::vector<std::string> warnings = stream.take_warnings();
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(says(warnings[0], start == 0.0 ? "t is in seconds" : "time (seconds)")) << warnings[0];
  }
}

TEST(LiveStream, CanBeUpdatedFromTasks) {
  LiveStream stream({.config = small_batches()});
  feed(stream, corner_walks(10, 5));
  const std::uint64_t before = stream.metrics().counters.detections;
  tbb::task_arena arena(8);
  arena.execute([&] {
    tbb::parallel_for(0, 400, [&](int k) {
      std::vector<Detection> rows;
      const double passed_s = 0.1 * (k / 8);
      for (int i = 0; i < 10; ++i)
        rows.push_back({std::to_string(k % 8) + "/" + std::to_string(i), 1000.0 + passed_s, {passed_s, 1.0 * i}});
      stream.update(rows.front().t_s, rows);
    });
  });
  EXPECT_GT(stream.metrics().counters.detections, before);
}

TEST(LiveStream, RejectsAConfigurationThatContradictsTheModel) {
  LiveStream first({.config = small_batches()});
  feed(first, corner_walks(10, 5));
  first.close();
  const StoredModel model = first.model();
  Config shorter = small_batches();
  shorter.episode.predict.horizon_s = 3.0;
  EXPECT_TRUE(says(message_of([&] { LiveStream({.start = model, .config = shorter}); }), "predict.horizon_s"));
  Config brief = small_batches();
  brief.episode.predict.observe_s = 2.0;
  EXPECT_TRUE(says(message_of([&] { LiveStream({.start = model, .config = brief}); }), "predict.observe_s = 2"));
  Config none = small_batches();
  none.service.batch = 0;
  EXPECT_TRUE(says(message_of([&] { LiveStream({.config = none}); }), "stream: service.batch"))
      << "sila.Stream shows it, too";
}

TEST(LiveStream, RejectsASceneThatBreaksItsInvariant) {
  Scene scene;
  scene.corners.push_back({"a", CurbFrame{}, {}});
  scene.primary = 3;
  EXPECT_TRUE(says(message_of([&] { LiveStream({.scene = scene}); }), "scene: primary = 3"));
}

TEST(LiveStream, UsesTheFrameOfAModelThatBeganWithAScene) {
  const EpisodeConfig config;
  StoredModel start;
  start.model = run_episode(Model{}, corner_walks(20, 5), config).model;
  start.model.sites.front().frame.from_tracks = false;
  LiveStream stream({.start = start});
  const std::vector<LivePrediction> predictions = feed(stream, corner_walks(3, 6));
  EXPECT_TRUE(std::ranges::any_of(predictions, [](const auto& made) { return !made.prediction.fallback; }));
}

TEST(LiveStream, EndsAllTracksAfterSilence) {
  LiveStream stream({});
  const std::vector<Detection> rows{{"a", 1.0, {0.0, 0.0}}, {"a", 1.1, {0.1, 0.0}}};
  stream.update(1.1, rows);
  stream.update(6.0, {});
  EXPECT_EQ(stream.metrics().pedestrians, 1u);
  stream.update(6.2, {});
  EXPECT_EQ(stream.metrics().pedestrians, 0u);
  stream.update(7.1, std::vector<Detection>{{"b", 7.0, {0.0, 0.0}}, {"b", 7.1, {0.1, 0.0}}});
  const Detection off_clock{"b", 60.0, {0.2, 0.0}}, car{"c", 12.2, {0.0, 0.0}, "Car"};
  stream.update(60.0, std::span(&off_clock, 1));
  EXPECT_EQ(stream.metrics().pedestrians, 1u);
  stream.update(12.2, std::span(&car, 1));
  EXPECT_EQ(stream.metrics().pedestrians, 0u) << "a detection that is rejected is silence, too";
}

TEST(LiveStream, WarnsOnceOfUnitsThatLookWrong) {
  for (const double scale : {1.0, 40.0}) {
    LiveStream stream({});
    std::vector<FramedTrajectory> walks = corner_walks(25, 5);
    for (FramedTrajectory& walk : walks) {
      for (Vector2& position : walk.track.positions_m) position *= scale;
    }
    feed(stream, walks);
    stream.close();
    const std::vector<std::string> warnings = stream.take_warnings();
    EXPECT_EQ(warnings.size(), scale == 1.0 ? 0u : 1u);
    EXPECT_TRUE(scale == 1.0 || says(warnings.at(0), "look like pixels"));
    EXPECT_TRUE(stream.take_warnings().empty());
  }
}

TEST(LiveStream, WarnsOfAnEpisodeThatFails) {
  const tests::ScratchFolder folder;
  std::filesystem::create_directory(folder / "gone");
  LiveStream stream({.file = folder / "gone" / "m.sila", .config = small_batches()});
  std::filesystem::remove_all(folder / "gone");
  feed(stream, corner_walks(10, 5));
  stream.close();
  EXPECT_EQ(stream.metrics().learner.failed_episodes, 1u);
  const std::vector<std::string> warnings = stream.take_warnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(says(warnings.front(), "an episode failed, and 10 tracks are lost"));
}

TEST(LiveStream, AModelFileThatIsGoneIsAnError) {
  EXPECT_THROW(LiveStream({.file = ""}), FormatError);
  const tests::ScratchFolder folder;
  LiveStream stream({.file = folder / "m.sila", .config = small_batches()});
  EXPECT_TRUE(stream.model().model.empty());
  feed(stream, corner_walks(10, 5));
  stream.close();
  std::filesystem::remove(folder / "m.sila");
  EXPECT_THROW((void)stream.model(), FormatError);
}

TEST(LiveStream, CloseOfEachThreadReturnsWhenAllIsLearnt) {
  LiveStream stream({.config = small_batches()});
  for (const Detection& row : stream_of(paths_of(corner_walks(9, 5)), 0.3)) stream.update(row.t_s, std::span(&row, 1));
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      stream.close();
      EXPECT_EQ(stream.metrics().learner.waiting_tracks, 0u);
      EXPECT_FALSE(stream.metrics().learner.learning);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(LiveStream, ServesSeveralThreads) {
  const tests::ScratchFolder folder;
  for (const bool with_file : {false, true}) {
    LiveStreamOptions options{.config = small_batches()};
    if (with_file) options.file = folder / "m.sila";
    LiveStream stream(options);
    std::thread reader([&] {
      for (int i = 0; i < 50; ++i) EXPECT_LE(stream.model().model.tracks, 20) << stream.metrics().lines;
    });
    feed(stream, corner_walks(20, 5));
    reader.join();
    stream.close();
    EXPECT_EQ(stream.metrics().learner.last_error, "");
    EXPECT_EQ(stream.model().model.tracks, 20);
    EXPECT_EQ(stream.model().episodes.size(), 2u);
  }
}

}  // namespace
}  // namespace sila
