#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "sila/evaluate/training_support.hpp"
#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// Pairs that walk side by side, a new pair every `stride_s`, in `recordings` recordings one after another.
std::vector<FramedTrajectory> pairs(int count, double stride_s, std::size_t recordings = 1) {
  std::vector<FramedTrajectory> tracks;
  for (int i = 0; i < 2 * count; ++i) {
    FramedTrajectory track{testing::walk(std::to_string(i), {{0, 0.1 * i}, {12, 0.1 * i}}, 1.2),
                           testing::square_frame()};
    for (double& time_s : track.track.times_s) time_s += stride_s * (i / 2);
    track.track.recording = static_cast<std::size_t>(i) * recordings / static_cast<std::size_t>(2 * count);
    tracks.push_back(std::move(track));
  }
  return tracks;
}

/// The least pause between a held-back and a learnt track of one recording [s]; negative where they overlap.
double least_pause_s(const Split& split) {
  double least = 1e9;
  for (const FramedTrajectory& held : split.test) {
    for (const FramedTrajectory& learnt : split.train) {
      if (held.track.recording != learnt.track.recording) continue;
      least = std::min(least, std::max(learnt.track.times_s.front() - held.track.times_s.back(),
                                       held.track.times_s.front() - learnt.track.times_s.back()));
    }
  }
  return least;
}

std::set<std::string> ids(const std::vector<FramedTrajectory>& tracks) {
  std::set<std::string> result;
  for (const FramedTrajectory& track : tracks) result.insert(track.track.id);
  return result;
}

TEST(Split, ByTimeNeverLearnsFromCompanionsOfHeldBackPeople) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Split by_time = split_tracks(pairs(60, 3.0), 0.15, seed, SplitBy::time);
    EXPECT_EQ(by_time.test.size(), 18u);
    EXPECT_GE(by_time.train.size(), 80u);
    EXPECT_GT(least_pause_s(by_time), kEmbargo_s);
    const Split by_track = split_tracks(pairs(60, 3.0), 0.15, seed, SplitBy::track);
    EXPECT_EQ(by_track.test.size() + by_track.train.size(), 120u);
    EXPECT_LT(least_pause_s(by_track), 0.0);
  }
}

TEST(Split, APersonWhoStaysForEverDoesNotTakeAllOthers) {
  std::vector<FramedTrajectory> tracks = pairs(60, 3.0);
  for (int i = 0; i < 120; i += 10) {  // one in ten stays until the end
    Trajectory& track = tracks[static_cast<std::size_t>(i)].track;
    while (track.times_s.back() < 200.0) {
      track.times_s.push_back(track.times_s.back() + 0.5);
      track.positions_m.push_back(track.positions_m.back());
    }
  }
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Split split = split_tracks(tracks, 0.15, seed, SplitBy::time);
    EXPECT_EQ(split.test.size(), 18u);
    EXPECT_GE(split.train.size(), 60u);
    EXPECT_GT(least_pause_s(split), kEmbargo_s);
  }
}

TEST(Split, ByTimeLearnsInTheOrderOfTime) {
  const Split split = split_tracks(pairs(60, 3.0, 3), 0.15, 5, SplitBy::time);
  ASSERT_GT(split.train.size(), 30u);
  for (std::size_t i = 1; i < split.train.size(); ++i) {
    const Trajectory &before = split.train[i - 1].track, &now = split.train[i].track;
    if (before.recording != now.recording) continue;
    EXPECT_LE(before.times_s.front(), now.times_s.front());
  }
}

TEST(Split, RecordingsHaveClocksOfTheirOwn) {
  std::vector<FramedTrajectory> tracks = pairs(10, 3.0);
  for (std::size_t i = 0; i < tracks.size(); ++i) tracks[i].track.recording = i;
  const Split split = split_tracks(tracks, 0.15, 1, SplitBy::time);
  EXPECT_EQ(split.test.size(), 3u);
  EXPECT_EQ(split.train.size(), 17u);  // of other recordings, whatever their clocks say
}

TEST(Split, KeepsTrackletsTogetherAndIsTheSeeds) {
  for (const SplitBy by : {SplitBy::time, SplitBy::track}) {
    std::vector<FramedTrajectory> tracks = pairs(40, 20.0);
    for (int i = 0; i < 20; ++i) {
      tracks.push_back(tracks[static_cast<std::size_t>(i)]);
      tracks.back().track.id += "#2";
    }
    const Split a = split_tracks(tracks, 0.15, 3, by), b = split_tracks(tracks, 0.15, 3, by);
    EXPECT_EQ(ids(a.train), ids(b.train));
    EXPECT_NE(ids(a.test), ids(split_tracks(tracks, 0.15, 4, by).test));
    std::set<std::string> held;
    for (const FramedTrajectory& track : a.test) held.insert(person_of(track.track.id));
    EXPECT_EQ(held.size(), 12u);
    for (const FramedTrajectory& track : a.train) EXPECT_FALSE(held.contains(person_of(track.track.id)));
  }
  EXPECT_THROW(split_tracks(pairs(4, 20.0), 1.0, 1, SplitBy::track), std::invalid_argument);
}

TEST(Split, CutsOnlyTheNumberOfATrackletFromAnId) {
  for (const char* id : {"17", "#1", "video:#1", "a#b", "17#", "", "#", "2"}) {
    EXPECT_EQ(person_of(id), id);
    EXPECT_EQ(person_of(id + std::string("#12")), *id == '\0' ? "#12" : id);
  }
  std::vector<FramedTrajectory> tracks = pairs(10, 3.0);
  for (FramedTrajectory& track : tracks) track.track.id.insert(0, "#");
  EXPECT_EQ(split_tracks(tracks, 0.15, 1, SplitBy::track).test.size(), 3u);
}

TEST(Split, RejectsTracksWithoutACommonClock) {
  EXPECT_TRUE(says(message_of([] { split_tracks(pairs(20, 0.0), 0.15, 1, SplitBy::time); }), "split=track"));
  EXPECT_EQ(split_tracks(pairs(20, 0.0), 0.15, 1, SplitBy::track).test.size(), 6u);
}

}  // namespace
}  // namespace sila
