#include "sila/core/clean.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "core/unit_warnings.hpp"
#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

Detections source_of(std::vector<Detection> rows, const std::string& name = "a.csv") {
  Detections result{name, std::move(rows)};
  result.rows_read = result.rows.size();
  return result;
}

CleanTracks clean_one(std::vector<Detection> rows, const CleanConfig& config = {}) {
  const Detections source = source_of(std::move(rows));
  return clean(std::span(&source, 1), config);
}

/// A walk along x at 1 m/s, a sample each 0.4 s.
std::vector<Detection> walk(const std::string& id, double from_s, std::size_t samples, double x0 = 0.0) {
  std::vector<Detection> rows;
  for (std::size_t i = 0; i < samples; ++i) {
    const double passed = 0.4 * static_cast<double>(i);
    rows.push_back({id, from_s + passed, Vector2(x0 + passed, 1.0)});
  }
  return rows;
}

std::vector<Detection> operator+(std::vector<Detection> a, const std::vector<Detection>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::size_t rows_of(const TrackReport& report, DropReason reason) {
  const auto found = std::find_if(report.dropped.begin(), report.dropped.end(),
                                  [&](const DroppedRows& entry) { return entry.reason == reason; });
  return found == report.dropped.end() ? 0 : found->rows;
}

std::size_t rows_dropped(const TrackReport& report) {
  std::size_t rows = 0;
  for (const DroppedRows& entry : report.dropped) rows += entry.rows;
  return rows;
}

std::vector<std::string> ids_of(const CleanTracks& tracks) {
  std::vector<std::string> ids;
  for (const Trajectory& track : tracks.trajectories) ids.push_back(track.id);
  return ids;
}

TEST(Clean, WarnsOfStampsInWholeSeconds) {
  std::vector<Detection> rows = walk("a", 0.0, 40);
  for (Detection& row : rows) row.t_s = std::floor(row.t_s);
  const CleanTracks tracks = clean_one(rows);
  ASSERT_FALSE(tracks.report.warnings.empty());
  EXPECT_TRUE(says(tracks.report.warnings[0], "another row of their track; give each person another id"));
  EXPECT_TRUE(clean_one(walk("a", 0.0, 40) + walk("b", 0.0, 40)).report.warnings.empty());
}

TEST(Clean, WarnsOfExchangedColumns) {
  std::vector<Detection> rows;
  for (int i = 0; i < 1000; ++i) {
    const double walked_m = 0.12 * (i % 50), noise_m = 0.1 * std::sin(7.0 * i);
    const bool along_y = i / 50 % 5 == 0;
    const Vector2 position_m = along_y ? Vector2(3.0 + noise_m, walked_m) : Vector2(walked_m + noise_m, 3.0);
    rows.push_back({std::to_string(i / 50), 0.1 * i, position_m});
  }
  EXPECT_TRUE(clean_one(rows).report.warnings.empty());
  for (Detection& row : rows) std::swap(row.t_s, row.position_m.x());
  const CleanTracks tracks = clean_one(rows);
  ASSERT_EQ(tracks.report.warnings.size(), 1U);
  EXPECT_TRUE(says(tracks.report.warnings[0], "are the columns t, x and y in another order"));
}

TEST(Clean, WarnsOfSlowTracksBesideFasterOnes) {
  std::vector<Detection> slow, alone;
  for (int i = 0; i < 40; ++i) {
    slow.push_back({"slow", 1.5 * i, Vector2(1.5 * i, 5.0)});
    alone.push_back({std::to_string(i), 1.5 * i, Vector2(1.5 * i, 5.0)});
  }
  const CleanTracks tracks = clean_one(walk("a", 0.0, 100) + slow);
  ASSERT_EQ(tracks.report.warnings.size(), 1U);
  EXPECT_TRUE(
      says(tracks.report.warnings[0], "40 of 140 rows stand alone: the rows of their tracks are more than 1 s"));
  EXPECT_TRUE(says(tracks.report.warnings[0], "to keep them, set clean.max_gap_s=3"));
  CleanConfig longer;
  longer.max_gap_s = 3.0;
  EXPECT_TRUE(clean_one(walk("a", 0.0, 100) + slow, longer).report.warnings.empty());
  EXPECT_TRUE(clean_one(walk("a", 0.0, 100) + alone).report.warnings.empty()) << "ids with one row each have no gap";
}

TEST(Clean, KeepsAnOrdinaryTrackAsItIs) {
  const CleanTracks tracks = clean_one(walk("17", 5.0, 4));
  ASSERT_EQ(ids_of(tracks), std::vector<std::string>{"17"});
  EXPECT_EQ(tracks.trajectories[0].times_s.front(), 5.0);
  EXPECT_EQ(tracks.trajectories[0].positions_m[1], Vector2(0.4, 1.0));
  EXPECT_EQ(tracks.report.rows_kept, 4U);
  EXPECT_TRUE(tracks.report.dropped.empty());
}

TEST(Clean, KeepsTracksOfDifferentFrameRates) {
  std::vector<Detection> rows = walk("2.5 Hz", 0.0, 20);
  for (int i = 0; i < 200; ++i) rows.push_back({"25 Hz", 0.04 * i, Vector2(0.04 * i, 5.0)});
  const CleanTracks tracks = clean_one(rows);
  EXPECT_EQ(ids_of(tracks), (std::vector<std::string>{"2.5 Hz", "25 Hz"}));
  EXPECT_EQ(tracks.report.rows_kept, rows.size());
  EXPECT_TRUE(tracks.report.warnings.empty());
}

TEST(Clean, SplitsAtGapsOfMoreThanASecondAndTheJitter) {
  const CleanTracks tracks = clean_one(walk("17", 0.0, 3) + walk("17", 1.87, 2, 2.0) + walk("17", 3.36, 2, 3.0));
  // The jitter is a fifth of 0.4 s: 0.8 to 1.87 s is no gap, 2.27 to 3.36 s is one.
  EXPECT_EQ(ids_of(tracks), (std::vector<std::string>{"17", "17#2"}));
  EXPECT_EQ(tracks.trajectories[0].times_s.size(), 5U);
  EXPECT_EQ(tracks.report.splits_at_gaps, 1U);
  EXPECT_EQ(tracks.report.splits_at_jumps, 0U);
}

TEST(Clean, ATrackerAtOneHertzMayJitter) {
  std::vector<Detection> rows;
  for (int i = 0; i < 40; ++i) rows.push_back({"17", i + 0.05 * std::sin(1.7 * i), Vector2(1.2 * i, 0.0)});
  const CleanTracks tracks = clean_one(rows);
  EXPECT_EQ(ids_of(tracks), std::vector<std::string>{"17"});
  EXPECT_TRUE(tracks.report.warnings.empty());
  for (Detection& row : rows) row.t_s *= 2.0;  // half as fast is too slow
  const CleanTracks slow = clean_one(rows);
  EXPECT_TRUE(slow.trajectories.empty());
  ASSERT_FALSE(slow.report.warnings.empty());
  EXPECT_TRUE(says(slow.report.warnings[0], "set clean.max_gap_s=4"));
}

TEST(Clean, SplitsReusedIdsAtJumps) {
  const CleanTracks tracks = clean_one(walk("17", 0.0, 3) + walk("17", 1.2, 3, 30.0));
  EXPECT_EQ(ids_of(tracks), (std::vector<std::string>{"17", "17#2"}));
  EXPECT_EQ(tracks.report.splits_at_jumps, 1U);
  EXPECT_EQ(tracks.report.splits_at_gaps, 0U);
}

TEST(Clean, DropsOneSampleOffAPathThatGoesOn) {
  std::vector<Detection> rows = walk("17", 0.0, 5);
  rows[2].position_m.y() += 40.0;
  const CleanTracks tracks = clean_one(rows);
  ASSERT_EQ(ids_of(tracks), std::vector<std::string>{"17"});
  EXPECT_EQ(tracks.trajectories[0].times_s.size(), 4U);
  EXPECT_EQ(rows_of(tracks.report, DropReason::outlier), 1U);
}

TEST(Clean, DoesNotTakeJitterOfStampsForSpeed) {
  std::vector<Detection> rows = walk("17", 0.0, 3);
  rows[1].t_s = rows[2].t_s - 0.001;  // 0.4 m in a millisecond
  EXPECT_EQ(clean_one(rows).trajectories.at(0).times_s[1], rows[1].t_s);
}

TEST(Clean, SortsRowsThatAreOutOfOrder) {
  std::vector<Detection> rows = walk("17", 0.0, 4);
  std::swap(rows[1], rows[2]);
  const CleanTracks tracks = clean_one(rows);
  ASSERT_EQ(tracks.trajectories.size(), 1U);
  EXPECT_TRUE(std::is_sorted(tracks.trajectories[0].times_s.begin(), tracks.trajectories[0].times_s.end()));
  EXPECT_EQ(tracks.report.out_of_order_rows, 1U);
  EXPECT_EQ(tracks.report.rows_kept, 4U);
}

TEST(Clean, DropsRepeatedRowsAveragesNearOnesAndRejectsContradictions) {
  std::vector<Detection> rows = walk("17", 0.0, 6);
  rows.push_back(rows[1]);
  rows.push_back({"17", rows[2].t_s, rows[2].position_m + Vector2(0.0, 0.2)});
  rows.push_back({"17", rows[3].t_s, rows[3].position_m + Vector2(0.0, 5.0)});
  const CleanTracks tracks = clean_one(rows);
  ASSERT_EQ(tracks.trajectories.size(), 1U);
  EXPECT_EQ(tracks.trajectories[0].times_s.size(), 5U);
  EXPECT_NEAR(tracks.trajectories[0].positions_m[2].y(), 1.1, 1e-12);
  EXPECT_EQ(rows_of(tracks.report, DropReason::repeated), 1U);
  EXPECT_EQ(rows_of(tracks.report, DropReason::averaged), 1U);
  EXPECT_EQ(rows_of(tracks.report, DropReason::contradictory), 2U);
  EXPECT_EQ(tracks.report.rows_read, tracks.report.rows_kept + rows_dropped(tracks.report));
}

TEST(Clean, TakesStampsWithinAMicrosecondForOne) {
  for (const double stamp_s : {12.4, 1000.0}) {
    const double next_s = std::nextafter(stamp_s, 1e9);
    const CleanTracks near = clean_one(walk("17", 0.0, 2) + walk("bad", stamp_s, 1) + walk("bad", next_s, 1, 0.3));
    EXPECT_EQ(ids_of(near), std::vector<std::string>{"17"});
    EXPECT_EQ(rows_of(near.report, DropReason::averaged), 1U);
    const CleanTracks far = clean_one(walk("bad", stamp_s, 2) + walk("bad", next_s, 1, 0.6));
    EXPECT_EQ(rows_of(far.report, DropReason::contradictory), 2U);
  }
}

TEST(Clean, DropsWhatIsNotFiniteOrAbsurd) {
  std::vector<Detection> rows = walk("17", 0.0, 4);
  rows.push_back({"17", 1.6, Vector2(std::nan(""), 0.0), {}, 77});
  rows.push_back({"17", std::numeric_limits<double>::infinity(), Vector2(0.0, 0.0)});
  rows.push_back({"17", 1.7, Vector2(2e8, 0.0)});
  rows.push_back({"17", 1e18, Vector2(0.0, 0.0)});
  const CleanTracks tracks = clean_one(rows);
  EXPECT_EQ(rows_of(tracks.report, DropReason::not_finite), 2U);
  EXPECT_EQ(rows_of(tracks.report, DropReason::absurd_value), 2U);
  EXPECT_TRUE(says(to_lines(tracks.report).at(2), "rows that lie beyond 3e7 m, or at a time beyond 1e12 s: 2"));
  EXPECT_EQ(tracks.report.rows_kept, 4U);
  EXPECT_EQ(tracks.report.dropped[0].first, "a.csv:77, track 17");
}

TEST(Clean, DropsLabelsThatAreNotPedestriansUnlessToldOtherwise) {
  std::vector<Detection> rows = walk("1", 0.0, 3) + walk("2", 0.0, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i].label = "Biker";
    rows[i + 3].label = "PED";
  }
  EXPECT_EQ(ids_of(clean_one(rows)), std::vector<std::string>{"2"});
  EXPECT_EQ(rows_of(clean_one(rows).report, DropReason::other_label), 3U);
  EXPECT_EQ(clean_one(rows, {.pedestrians_only = false}).trajectories.size(), 2U);
}

TEST(Clean, DropsSingleSamplesAndKeepsStandingTracksButCountsThem) {
  std::vector<Detection> rows = walk("1", 0.0, 1);
  for (const double t : {0.0, 0.4, 0.8}) rows.push_back({"2", t, Vector2(3, 3)});
  const CleanTracks tracks = clean_one(rows);
  EXPECT_EQ(ids_of(tracks), std::vector<std::string>{"2"});
  EXPECT_EQ(rows_of(tracks.report, DropReason::single_sample), 1U);
  EXPECT_EQ(tracks.report.standing_tracks, 1U);
}

TEST(Clean, SortsTracksByStartThenById) {
  const CleanTracks tracks = clean_one(walk("10", 0.0, 2) + walk("9", 0.0, 2) + walk("a", 0.0, 2) + walk("1", 5.0, 2));
  EXPECT_EQ(ids_of(tracks), (std::vector<std::string>{"9", "10", "a", "1"}));
}

TEST(Clean, MakesIdsUniqueAcrossSourcesAndTracklets) {
  const auto ids = [](std::vector<std::string> names) {
    std::vector<Detections> sources;
    for (const std::string& name : names) sources.push_back(source_of(walk("7", 0.0, 2), name));
    return ids_of(clean(sources, {}));
  };
  EXPECT_EQ(ids({"d/a.csv", "d/b.csv.gz"}), (std::vector<std::string>{"a:7", "b:7"}));
  EXPECT_EQ(ids({"v1/a.txt", "v2/a.txt"}), (std::vector<std::string>{"v1/a:7", "v2/a:7"}));
  EXPECT_EQ(ids({"a.txt", "a.txt"}), (std::vector<std::string>{"1:7", "2:7"}));
  const CleanTracks taken = clean_one(walk("7", 0.0, 2) + walk("7", 9.0, 2) + walk("7#2", 20.0, 2));
  EXPECT_EQ(ids_of(taken), (std::vector<std::string>{"7", "7#3", "7#2"}));
}

TEST(Clean, RejectsAConfigurationOutOfRange) {
  EXPECT_THROW(clean({}, {.max_gap_s = 0.0}), std::invalid_argument);
}

TEST(Clean, AddsTheReadersDropsToItsOwn) {
  Detections source = source_of(walk("1", 0.0, 3));
  source.rows_read = 5;
  source.dropped = {{DropReason::lost, 2, "a.csv:9"}};
  source.warnings = {"careful"};
  const TrackReport report = clean(std::span(&source, 1), {}).report;
  EXPECT_EQ(report.rows_read, 5U);
  EXPECT_EQ(rows_of(report, DropReason::lost), 2U);
  EXPECT_EQ(report.warnings, std::vector<std::string>{"careful"});
  const auto lines = to_lines(report);
  EXPECT_EQ(lines.at(0), "1 track of 1 id in 1 file; 3 of 5 rows kept");
  EXPECT_EQ(lines.at(1), "dropped rows that are marked as lost: 2 (first: a.csv:9)");
  EXPECT_EQ(lines.back(), "warning: careful");
}

/// Rows with every fault that `clean` knows.
std::vector<Detection> messy_rows(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Detection> rows;
  for (int id = 0; id < 12; ++id) {
    double t = 10.0 * uniform(random);
    Vector2 position(20.0 * uniform(random), 20.0 * uniform(random));
    for (int i = 0; i < 60; ++i) {
      t += uniform(random) < 0.03 ? 1.5 : 0.2 + 0.05 * uniform(random);
      position += Vector2(0.3 * uniform(random), 0.1);
      if (uniform(random) < 0.02) position += Vector2(50.0, 0.0);
      rows.push_back({std::to_string(id), t, position, uniform(random) < 0.02 ? "car" : "pedestrian"});
      if (uniform(random) < 0.03) rows.push_back(rows.back());
      if (uniform(random) < 0.03) rows.push_back({std::to_string(id), t, position + Vector2(uniform(random), 0.0)});
      if (uniform(random) < 0.02) rows.push_back({std::to_string(id), t, Vector2(std::nan(""), 0.0)});
    }
  }
  return rows;
}

TEST(Clean, GivesTheSameTracksInWhateverOrderTheRowsCome) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<Detection> rows = messy_rows(random);
    const CleanTracks before = clean_one(rows);
    std::shuffle(rows.begin(), rows.end(), random);
    const CleanTracks after = clean_one(rows);
    ASSERT_EQ(ids_of(before), ids_of(after));
    for (std::size_t i = 0; i < before.trajectories.size(); ++i) {
      EXPECT_EQ(before.trajectories[i].times_s, after.trajectories[i].times_s);
      EXPECT_EQ(before.trajectories[i].positions_m, after.trajectories[i].positions_m);
    }
    for (const DropReasonText& reason : kDropReasons) {
      EXPECT_EQ(rows_of(before.report, reason.reason), rows_of(after.report, reason.reason)) << reason.name;
    }
  }
}

TEST(Clean, AccountsForEveryRowAndKeepsTheInvariantOfTrajectories) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const CleanTracks tracks = clean_one(messy_rows(random));
    EXPECT_EQ(tracks.report.rows_read, tracks.report.rows_kept + rows_dropped(tracks.report));
    std::size_t samples = 0;
    std::map<std::string, int> ids;
    for (const Trajectory& track : tracks.trajectories) {
      validate(track);
      samples += track.times_s.size();
      EXPECT_EQ(++ids[track.id], 1) << track.id;
      for (std::size_t i = 1; i < track.times_s.size(); ++i)
        EXPECT_LE(track.times_s[i] - track.times_s[i - 1], 1.0 + 1e-6);
    }
    EXPECT_EQ(samples, tracks.report.rows_kept);
    EXPECT_GT(tracks.report.splits_at_gaps + tracks.report.splits_at_jumps, 0U);  // else the rows were not messy
  }
}

TEST(DropReasons, AreInTheOrderOfTheEnumeration) {
  for (std::size_t i = 0; i < kDropReasons.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kDropReasons[i].reason), i);
    EXPECT_EQ(name_of(kDropReasons[i].reason), kDropReasons[i].name);
  }
}

Trajectory straight(double speed, double interval_s, double start) {
  return testing::sampled(40, interval_s, [&](int i) { return Vector2(start + speed * i * interval_s, start); });
}

TEST(UnitWarnings, AreSilentOnWalkersInMetresAndSeconds) {
  const std::vector<Trajectory> tracks = {straight(1.3, 0.4, 0.1), straight(0.0, 0.4, 0.2), straight(3.5, 0.04, 0.3)};
  EXPECT_TRUE(unit_warnings(tracks, 1.0).empty());
  EXPECT_TRUE(unit_warnings({}, 1.0).empty());
}

TEST(UnitWarnings, SeePixelsByTheirSpeedOrByWholeNumbers) {
  const std::vector<Trajectory> fast = {straight(35.0, 0.033, 200.1), straight(30.0, 0.033, 100.1)};
  ASSERT_EQ(unit_warnings(fast, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(fast, 1.0)[0], "look like pixels"));
  Trajectory slow = straight(5.0, 0.4, 600.0);
  Trajectory far = straight(0.0, 0.4, 100.0);
  const std::vector<Trajectory> whole = {slow, far};
  ASSERT_EQ(unit_warnings(whole, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(whole, 1.0)[0], "multiples of one half"));
}

TEST(UnitWarnings, SeeMetresThatWereTakenAsPixels) {
  const std::vector<Trajectory> tracks(5, straight(0.03, 0.4, 0.1));
  ASSERT_EQ(unit_warnings(tracks, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(tracks, 1.0)[0], "are the positions metres"));
  EXPECT_TRUE(says(unit_warnings(tracks, 1.0)[0], "a model learnt in pixels needs pixels"));
  EXPECT_TRUE(unit_warnings(std::span(tracks).first(4), 1.0).empty());
}

TEST(UnitWarnings, SeeFeetAndWrongFrameRatesByHowFastPeopleWalk) {
  const std::vector<Trajectory> feet(5, straight(4.3, 0.4, 0.1)), runners(5, straight(2.9, 0.4, 0.1));
  ASSERT_EQ(unit_warnings(feet, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(feet, 1.0)[0], "are the positions feet or pixels"));
  EXPECT_TRUE(says(unit_warnings(feet, 1.0)[0], "If they are not metres, give a camera (--camera), metres_per_unit"));
  EXPECT_TRUE(unit_warnings(runners, 1.0).empty());
}

TEST(UnitWarnings, SeeDegreesThatWereTakenAsMetres) {
  const std::vector<Trajectory> tracks(5, straight(1.3e-5, 0.4, 48.1));
  ASSERT_EQ(unit_warnings(tracks, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(tracks, 1.0)[0], "latitude and longitude"));
}

TEST(UnitWarnings, SeeStampsThatAreNotSeconds) {
  const std::vector<Trajectory> milliseconds = {straight(0.0013, 40.0, 0.1)};
  ASSERT_EQ(unit_warnings(milliseconds, 1.0).size(), 1U);
  EXPECT_TRUE(says(unit_warnings(milliseconds, 1.0)[0], "milliseconds"));
  EXPECT_TRUE(unit_warnings(milliseconds, 1.0)[0].ends_with("set clean.max_gap_s")) << "80 s is out of range";
}

}  // namespace
}  // namespace sila
