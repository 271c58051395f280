#include "sila/sim/simulate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "support/message_of.hpp"
#include "support/polygon.hpp"

namespace sila {
namespace {

constexpr Layout kLayouts[] = {Layout::four_way, Layout::t_junction, Layout::acute, Layout::obtuse};

SimulationConfig config_of(Layout layout, int tracks = 400, std::uint64_t seed = 7) {
  return {.layout = layout, .tracks = tracks, .seed = seed};
}

std::uint64_t fingerprint(const Simulation& simulation) {
  std::uint64_t hash = 14695981039346656037ULL;
  const auto add = [&](double value) { hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ULL; };
  for (const std::vector<Trajectory>* tracks : {&simulation.tracks, &simulation.truth})
    for (const Trajectory& track : *tracks)
      for (std::size_t i = 0; i < track.times_s.size(); ++i) {
        add(track.times_s[i]);
        add(track.positions_m[i].x());
        add(track.positions_m[i].y());
      }
  return hash;
}

/// Behind both curbs of a corner, or on a drawn sidewalk (the straight side of a T has no corner).
bool off_the_road(const IntersectionScene& scene, const Vector2& point) {
  const auto behind = [&](const NamedCorner& corner) { return to_curb(corner.frame, point).minCoeff() >= 0.0; };
  const auto on = [&](const Polygon& area) { return contains(area, point); };
  return std::ranges::any_of(scene.corners, behind) || std::ranges::any_of(scene.sidewalks, on);
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.at(values.size() / 2);
}

double share_of(std::size_t part, std::size_t all) {
  return static_cast<double>(part) / static_cast<double>(all);
}

double duration_s(const Trajectory& track) {
  return track.times_s.back() - track.times_s.front();
}

/// The heading at the end differs by over 45 degrees from that at the start, each over 1.5 s.
bool turns(const Trajectory& truth) {
  if (truth.positions_m.size() < 31) return false;
  const Vector2 first = truth.positions_m[15] - truth.positions_m[0];
  const Vector2 last = truth.positions_m.back() - truth.positions_m[truth.positions_m.size() - 16];
  return first.norm() > 0.5 && last.norm() > 0.5 && first.dot(last) < std::sqrt(0.5) * first.norm() * last.norm();
}

/// Moves less than 0.15 m in some second.
bool stops(const Trajectory& truth) {
  for (std::size_t i = 10; i < truth.positions_m.size(); ++i)
    if ((truth.positions_m[i] - truth.positions_m[i - 10]).norm() < 0.15) return true;
  return false;
}

class EveryLayout : public testing::TestWithParam<Layout> {};
INSTANTIATE_TEST_SUITE_P(Simulation, EveryLayout, testing::ValuesIn(kLayouts));

TEST_P(EveryLayout, GivesTheSameBitsForTheSameSeed) {
  const Simulation a = simulate(config_of(GetParam(), 60)), b = simulate(config_of(GetParam(), 60));
  EXPECT_EQ(fingerprint(a), fingerprint(b));
  EXPECT_NE(fingerprint(a), fingerprint(simulate(config_of(GetParam(), 60, 8))));
}

TEST_P(EveryLayout, GivesValidTracksInOrderOfTheirStart) {
  const Simulation simulation = simulate(config_of(GetParam()));
  ASSERT_EQ(simulation.tracks.size(), 400U);
  ASSERT_EQ(simulation.truth.size(), 400U);
  ASSERT_EQ(simulation.traits.size(), 400U);
  std::set<std::string> ids;
  double previous_s = 0.0;
  for (const Trajectory& track : simulation.tracks) {
    validate(track);
    EXPECT_TRUE(ids.insert(track.id).second) << track.id;
    EXPECT_GE(track.times_s.front(), previous_s);
    EXPECT_GE(duration_s(track), 2.0 - 1e-9);
    EXPECT_LT(duration_s(track), 150.0) << "somebody is stuck: track " << track.id;
    previous_s = track.times_s.front();
    for (double t : track.times_s) ASSERT_EQ(t, std::round(t * 10.0) * 0.1);
  }
}

TEST_P(EveryLayout, TellsTheTruthBehindEachTrackWithoutGaps) {
  const Simulation simulation = simulate(config_of(GetParam()));
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < simulation.tracks.size(); ++i) {
    const Trajectory &track = simulation.tracks[i], &truth = simulation.truth[i];
    validate(truth);
    ASSERT_EQ(track.id, truth.id);
    ASSERT_EQ(track.times_s.front(), truth.times_s.front());
    ASSERT_EQ(track.times_s.back(), truth.times_s.back());
    for (std::size_t k = 1; k < truth.times_s.size(); ++k)
      ASSERT_NEAR(truth.times_s[k] - truth.times_s[k - 1], 0.1, 1e-9);
    for (std::size_t k = 0; k < track.times_s.size(); ++k) {
      const auto at = std::ranges::lower_bound(truth.times_s, track.times_s[k]) - truth.times_s.begin();
      squares += (track.positions_m[k] - truth.positions_m[static_cast<std::size_t>(at)]).squaredNorm();
      count += 2.0;
    }
  }
  // About 100,000 samples with a memory of 0.8 s: the estimate is good to 1 %.
  EXPECT_NEAR(std::sqrt(squares / count), 0.03, 0.03 * 0.03);
}

TEST_P(EveryLayout, KeepsPeopleOutOfBuildings) {
  const Simulation simulation = simulate(config_of(GetParam()));
  for (const Trajectory& truth : simulation.truth)
    for (const Vector2& point : truth.positions_m)
      for (const Polygon& building : simulation.scene.buildings)
        ASSERT_FALSE(contains(building, point)) << truth.id << " at " << point.transpose();
}

TEST_P(EveryLayout, LetsOnlyJaywalkersLeaveTheCrosswalks) {
  const Simulation simulation = simulate(config_of(GetParam(), 989));
  std::size_t jaywalkers = 0;
  for (std::size_t i = 0; i < simulation.truth.size(); ++i) {
    std::size_t outside = 0;
    for (const Vector2& point : simulation.truth[i].positions_m) {
      const auto on = [&](const Polygon& area) { return contains(area, point); };
      if (!off_the_road(simulation.scene, point) && std::ranges::none_of(simulation.scene.crosswalks, on)) ++outside;
    }
    if (simulation.traits[i].leaves_crosswalk) {
      jaywalkers += outside > 0 ? 1 : 0;
      continue;
    }
    EXPECT_EQ(outside, 0U) << "track " << simulation.truth[i].id;
  }
  EXPECT_GT(jaywalkers, 0U);
}

TEST_P(EveryLayout, LetsNobodyWalkThroughAnybody) {
  const Simulation simulation = simulate(config_of(GetParam(), 989));
  std::map<long, std::vector<std::pair<std::size_t, Vector2>>> present;
  for (std::size_t i = 0; i < simulation.truth.size(); ++i)
    for (std::size_t k = 0; k < simulation.truth[i].times_s.size(); ++k)
      present[std::lround(10.0 * simulation.truth[i].times_s[k])].push_back(
          {simulation.traits[i].walker, simulation.truth[i].positions_m[k]});
  double nearest_m = 100.0;
  std::size_t pairs = 0, close = 0;
  for (const auto& [time, people] : present)
    for (std::size_t a = 0; a < people.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        if (people[a].first == people[b].first) continue;
        const double distance = (people[a].second - people[b].second).norm();
        nearest_m = std::min(nearest_m, distance);
        close += distance < 0.4 ? 1 : 0;
        ++pairs;
      }
  EXPECT_GT(nearest_m, 0.2);
  EXPECT_GT(pairs, 100000U);
  EXPECT_LT(share_of(close, pairs), 0.002);
}

TEST_P(EveryLayout, MovesPeopleSmoothly) {
  const Simulation simulation = simulate(config_of(GetParam()));
  std::vector<double> accelerations;
  for (const Trajectory& truth : simulation.truth)
    for (std::size_t k = 2; k < truth.positions_m.size(); ++k) {
      const Vector2 now = truth.positions_m[k] - truth.positions_m[k - 1];
      const Vector2 before = truth.positions_m[k - 1] - truth.positions_m[k - 2];
      ASSERT_LT(now.norm() / 0.1, 3.5) << "track " << truth.id;
      accelerations.push_back((now - before).norm() / 0.01);
    }
  std::ranges::sort(accelerations);
  EXPECT_LT(accelerations[accelerations.size() * 99 / 100], 2.5);
}

TEST_P(EveryLayout, LooksLikePeople) {
  const Simulation simulation = simulate(config_of(GetParam(), 989));
  std::size_t turning = 0, stopping = 0, gaps = 0, steps = 0;
  double speed_sum = 0.0;
  std::vector<double> durations;
  for (std::size_t i = 0; i < simulation.tracks.size(); ++i) {
    const Trajectory &track = simulation.tracks[i], &truth = simulation.truth[i];
    turning += turns(truth) ? 1U : 0U;
    stopping += stops(truth) ? 1U : 0U;
    gaps += track.times_s.size() < truth.times_s.size() ? 1U : 0U;
    durations.push_back(duration_s(track));
    for (std::size_t k = 1; k < truth.positions_m.size(); ++k) {
      const double speed = (truth.positions_m[k] - truth.positions_m[k - 1]).norm() / 0.1;
      if (speed < 0.3) continue;
      speed_sum += speed;
      ++steps;
    }
  }
  EXPECT_NEAR(speed_sum / static_cast<double>(steps), 1.25, 0.1);
  EXPECT_GT(share_of(turning, 989), 0.4);
  EXPECT_LT(share_of(turning, 989), 0.8);
  EXPECT_GT(share_of(stopping, 989), 0.2);
  EXPECT_LT(share_of(stopping, 989), 0.5);
  EXPECT_GT(share_of(gaps, 989), 0.2);
  EXPECT_LT(share_of(gaps, 989), 0.45);
  EXPECT_GT(median(durations), 12.0);
  EXPECT_LT(median(durations), 25.0);
}

/// Mean modified Hausdorff distance of constant velocity (of the last 0.8 s) over windows of 3.2 s and 5 s of people
/// who moved.
double constant_velocity_mhd_m(const std::vector<Trajectory>& tracks) {
  double sum = 0.0, windows = 0.0;
  for (const Trajectory& track : tracks) {
    for (std::size_t from = 0; from + 82 < track.positions_m.size(); from += 82) {
      if (track.times_s[from + 82] - track.times_s[from] > 8.25) continue;  // a gap in the window
      const Vector2 now = track.positions_m[from + 32];
      const Vector2 velocity = (now - track.positions_m[from + 24]) / 0.8;
      if ((now - track.positions_m[from]).norm() < 0.5) continue;
      std::vector<Vector2> predicted, real;
      for (std::size_t k = 1; k <= 10; ++k) {
        predicted.push_back(now + 0.5 * static_cast<double>(k) * velocity);
        real.push_back(track.positions_m[from + 32 + 5 * k]);
      }
      const auto one_sided = [](const std::vector<Vector2>& a, const std::vector<Vector2>& b) {
        double total = 0.0;
        for (const Vector2& p : a) {
          double nearest = 1e9;
          for (const Vector2& q : b) nearest = std::min(nearest, (p - q).norm());
          total += nearest;
        }
        return total / static_cast<double>(a.size());
      };
      sum += std::max(one_sided(predicted, real), one_sided(real, predicted));
      windows += 1.0;
    }
  }
  return sum / windows;
}

TEST_P(EveryLayout, IsAsHardForConstantVelocityAsRealPlacesAre) {
  // Real corners and crossings give means of 0.55 to 1.3 m on the same windows.
  const double mhd_m = constant_velocity_mhd_m(simulate(config_of(GetParam(), 989)).tracks);
  EXPECT_GT(mhd_m, 0.55);
  EXPECT_LT(mhd_m, 1.3);
}

TEST(Simulation, GivesTheBitsRecordedOnce) {
  // Pins the promise that the bits depend on the seed alone, not on compiler or standard library. A change of the model
  // changes these numbers on purpose; a change of the tool chain must not.
  EXPECT_EQ(fingerprint(simulate(config_of(Layout::four_way, 100, 1))), 2287484658517194216ULL);
  EXPECT_EQ(fingerprint(simulate(config_of(Layout::acute, 100, 1))), 16771066062875091329ULL);
}

TEST(Simulation, DrawsFreeSpeedsAsConfigured) {
  SimulationConfig config = config_of(Layout::four_way, 2000);
  config.group_share = 0.0;
  double sum = 0.0, squares = 0.0;
  const Simulation simulation = simulate(config);
  for (const WalkerTraits& traits : simulation.traits) {
    sum += traits.free_speed_mps;
    squares += traits.free_speed_mps * traits.free_speed_mps;
  }
  const double mean = sum / 2000.0;
  EXPECT_NEAR(mean, 1.34, 4.0 * 0.26 / std::sqrt(2000.0));
  EXPECT_NEAR(std::sqrt(squares / 2000.0 - mean * mean), 0.26, 0.02);
}

TEST(Simulation, TurnsEverybodyOrNobodyRoundTheCornerIfToldSo) {
  SimulationConfig config = config_of(Layout::four_way, 100);
  config.jaywalk_share = 0.0;  // who crosses away from the crosswalk may then turn at the next corner
  config.turn_share = 1.0;
  for (const WalkerTraits& traits : simulate(config).traits) EXPECT_TRUE(traits.rounds_corner && traits.crossings == 0);
  config.turn_share = 0.0;
  for (const WalkerTraits& traits : simulate(config).traits) EXPECT_TRUE(!traits.rounds_corner && traits.crossings > 0);
}

TEST(Simulation, LetsPeopleEnterTheRoadwayOnlyWhileTheSignalAllows) {
  SimulationConfig config = config_of(Layout::four_way, 989);
  config.jaywalk_share = 0.0;
  const Simulation simulation = simulate(config);
  // Within a metre of a corner two crosswalks overlap and the curb is rounded.
  const auto in_roadway = [&](const Vector2& point) {
    const auto near = [&](const NamedCorner& corner) { return (corner.frame.origin_m - point).norm() < 1.0; };
    return !off_the_road(simulation.scene, point) && std::ranges::none_of(simulation.scene.corners, near);
  };
  std::size_t entries = 0;
  for (const Trajectory& truth : simulation.truth) {
    for (std::size_t k = 1; k < truth.times_s.size(); ++k) {
      if (in_roadway(truth.positions_m[k - 1]) || !in_roadway(truth.positions_m[k])) continue;
      const auto on = [&](const Polygon& area) { return contains(area, truth.positions_m[k]); };
      const auto arm = std::ranges::find_if(simulation.scene.crosswalks, on) - simulation.scene.crosswalks.begin();
      const double phase = std::fmod(truth.times_s[k] + (arm % 2 == 0 ? 0.0 : 20.0), 40.0);
      // A pedestrian who decided in the last green second is on the roadway a few steps later.
      EXPECT_LT(phase, 16.0 + 3.0) << "track " << truth.id << " at " << truth.times_s[k] << " s, crosswalk " << arm;
      ++entries;
    }
  }
  EXPECT_GT(entries, 200U);
}

TEST(Simulation, ReportsTheTruthWhenTheTrackerIsPerfect) {
  SimulationConfig config = config_of(Layout::obtuse, 50);
  config.noise_std_m = config.occlusions_per_min = config.cut_share = 0.0;
  const Simulation simulation = simulate(config);
  for (std::size_t i = 0; i < simulation.tracks.size(); ++i) {
    ASSERT_EQ(simulation.tracks[i].times_s, simulation.truth[i].times_s);
    ASSERT_EQ(simulation.tracks[i].positions_m, simulation.truth[i].positions_m);
  }
}

TEST(Simulation, CutsTracksAndSwitchesIdentities) {
  SimulationConfig config = config_of(Layout::four_way, 300);
  config.cut_share = 0.0;
  std::vector<double> whole, cut;
  for (const Trajectory& track : simulate(config).tracks) whole.push_back(duration_s(track));
  config.cut_share = 1.0;
  const Simulation simulation = simulate(config);
  std::set<std::size_t> walkers;
  for (std::size_t i = 0; i < simulation.tracks.size(); ++i) {
    cut.push_back(duration_s(simulation.tracks[i]));
    walkers.insert(simulation.traits[i].walker);
  }
  EXPECT_LT(median(cut), 0.75 * median(whole));
  EXPECT_LT(walkers.size(), 280U);
}

TEST(Simulation, LetsPeopleStandAndWalkInGroups) {
  SimulationConfig config = config_of(Layout::four_way, 300);
  config.stop_share = 1.0;
  config.group_share = 1.0;
  std::size_t standing = 0;
  for (const WalkerTraits& traits : simulate(config).traits) {
    EXPECT_TRUE(traits.in_group);
    standing += traits.stands ? 1 : 0;
  }
  EXPECT_GT(standing, 60U);
}

TEST(Simulation, SamplesAtTheIntervalOfTheTracker) {
  SimulationConfig config = config_of(Layout::t_junction, 40);
  config.sample_interval_s = 0.4;
  for (const Trajectory& truth : simulate(config).truth)
    for (std::size_t k = 1; k < truth.times_s.size(); ++k)
      ASSERT_NEAR(truth.times_s[k] - truth.times_s[k - 1], 0.4, 1e-9);
}

TEST(Simulation, RejectsValuesOutOfRangeByName) {
  EXPECT_TRUE(says(message_of([] { simulate({.tracks = 0}); }), "simulate: tracks = 0 is outside"));
  EXPECT_TRUE(says(message_of([] { simulate({.noise_std_m = std::nan("")}); }), "noise_std_m"));
}

}  // namespace
}  // namespace sila
