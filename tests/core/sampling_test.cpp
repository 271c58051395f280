#include "sila/core/sampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "sila/core/companions.hpp"
#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

CurbFrame square_frame(double width_m = 2.5) {
  return testing::square_frame(width_m, CurbScaling::mean_width);
}
using testing::walk;

TEST(Sampling, KeepsPositionAndVelocityOfAStraightWalk) {
  const Trajectory track = walk("a", {{0, 0}, {20, 10}}, 1.3);
  const CurbTrajectory seen = observe(track, 60, square_frame(2.0), 3.2, {});
  ASSERT_EQ(seen.times_s.size(), 16u);
  EXPECT_DOUBLE_EQ(seen.times_s.back(), track.times_s[60]);
  EXPECT_NEAR(seen.times_s.front(), track.times_s[60] - 3.0, 1e-12);
  const Vector2 velocity = 1.3 * Vector2(20, 10).normalized();
  for (std::size_t t = 0; t < seen.times_s.size(); ++t) {
    EXPECT_LT((velocity_to_world(seen.frame, seen.velocities[t]) - velocity).norm(), 1e-9);
    EXPECT_LT((to_world(seen.frame, seen.positions[t]) - velocity * seen.times_s[t]).norm(), 1e-9);
  }
}

TEST(Sampling, SaysHowLongAPersonHasStayedWhereTheyAre) {
  Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  const std::size_t arrived = track.times_s.size() - 1;
  EXPECT_NEAR(observe(track, arrived, square_frame(), 3.2, {}).still_s, 0.5, 0.11);
  for (int i = 0; i < 800; ++i) {
    track.times_s.push_back(track.times_s.back() + 0.1);
    track.positions_m.push_back(track.positions_m[arrived]);
  }
  EXPECT_NEAR(observe(track, arrived + 100, square_frame(), 3.2, {}).still_s, 10.5, 0.11);
  EXPECT_NEAR(observe(track, arrived + 800, square_frame(), 3.2, {}).still_s, 60.0, 0.11);  // at most
}

/// The positions of a pedestrian who turns on a circle, with tracker noise.
Trajectory circling(double interval_s, double noise_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Trajectory track{"a", {}, {}};
  for (double t = 0.0; t < 8.0; t += interval_s) {
    track.times_s.push_back(t);
    track.positions_m.push_back(4.0 * Vector2(std::cos(0.3 * t), std::sin(0.3 * t)) +
                                noise_m * Vector2(normal(random), normal(random)));
  }
  return track;
}

/// The smoothed positions of a track in [from_s, until_s), and their times.
struct Smoothed {
  std::vector<double> times_s;
  std::vector<Vector2> positions_m;
};

Smoothed smoothed(const Trajectory& track, double interval_s, double from_s, double until_s) {
  const CurbTrajectory states = resample(track, square_frame(), {.interval_s = interval_s});
  Smoothed part;
  for (std::size_t i = 0; i < states.times_s.size(); ++i) {
    if (states.times_s[i] < from_s || states.times_s[i] >= until_s) continue;
    part.times_s.push_back(states.times_s[i]);
    part.positions_m.push_back(to_world(states.frame, states.positions[i]));
  }
  return part;
}

double rms_error_m(const Trajectory& track) {
  const auto [times_s, positions_m] = smoothed(track, 0.11, 0.5, 7.0);
  EXPECT_GT(times_s.size(), 50u);
  double sum = 0.0;
  for (std::size_t i = 0; i < times_s.size(); ++i)
    sum += (positions_m[i] - 4.0 * Vector2(std::cos(0.3 * times_s[i]), std::sin(0.3 * times_s[i]))).squaredNorm();
  return std::sqrt(sum / static_cast<double>(times_s.size()));
}

TEST(Sampling, InterpolatesCleanTracksAtAnyRate) {
  for (const double interval_s : {0.02, 0.1, 0.4}) EXPECT_LT(rms_error_m(circling(interval_s, 0.0, 1)), 0.005);
}

TEST(Sampling, FiltersNoisyTracks) {
  for (const double noise_m : {0.05, 0.1, 0.2})
    EXPECT_LT(rms_error_m(circling(0.04, noise_m, 2)), 0.6 * std::sqrt(2.0) * noise_m) << noise_m;
}

TEST(Sampling, NeverMakesAStaircaseOfCoarseTracks) {
  const std::vector<Vector2> positions_m = smoothed(circling(0.4, 0.0, 1), 0.1, 2.0, 6.0).positions_m;
  ASSERT_GT(positions_m.size(), 35u);
  for (std::size_t i = 1; i < positions_m.size(); ++i)
    EXPECT_NEAR((positions_m[i] - positions_m[i - 1]).norm(), 0.12, 0.006);  // 1.2 m/s
}

TEST(Sampling, DoesNotDependOnTheOffsetOfTheClock) {
  const Trajectory track = testing::sampled(
      201, 0.1, [](int i) { return Vector2(0.13 * i + 0.03 * std::sin(7.0 * i * i), 0.03 * std::cos(5.0 * i * i)); });
  Trajectory later = track;
  for (double& t_s : later.times_s) t_s += 1000.0;
  for (std::size_t last = 50; last <= 200; ++last) {
    const CurbTrajectory a = observe(track, last, square_frame(), 3.2, {}),
                         b = observe(later, last, square_frame(), 3.2, {});
    ASSERT_EQ(a.positions.size(), b.positions.size());
    for (std::size_t i = 0; i < a.positions.size(); ++i) EXPECT_LT((a.positions[i] - b.positions[i]).norm(), 1e-9);
  }
}

TEST(Sampling, WhatComesLaterNeverChangesWhatWasObserved) {
  const Trajectory track = walk("a", {{0, 0}, {10, 0}, {10, 10}}, 1.2, 0.13, 0.05, 3);
  std::mt19937 random(11);
  for (std::size_t last : {25u, 40u, 70u}) {
    const CurbTrajectory expected = observe(track, last, square_frame(), 3.2, {});
    Trajectory replaced = track;
    for (std::size_t i = last + 1; i < replaced.times_s.size(); ++i) {
      replaced.positions_m[i] = Vector2(1e5, -1e5) * static_cast<double>(random() % 7);
      replaced.times_s[i] = replaced.times_s[i - 1] + 0.01 * static_cast<double>(1 + random() % 90);
    }
    Trajectory cut = track;
    cut.times_s.resize(last + 1);
    cut.positions_m.resize(last + 1);
    for (const Trajectory& other : {replaced, cut}) {
      const CurbTrajectory found = observe(other, last, square_frame(), 3.2, {});
      EXPECT_EQ(found.times_s, expected.times_s);
      EXPECT_EQ(found.positions, expected.positions);
      EXPECT_EQ(found.velocities, expected.velocities);
    }
  }
}

TEST(Sampling, PredictionsAreDueAtRealSamplesFromTheObservedSpanOn) {
  Trajectory track{"a", {}, {}};
  for (double t : {10.0, 10.9, 11.8, 12.7, 13.3, 13.6, 14.1, 14.4, 15.0, 16.9}) {
    track.times_s.push_back(t);
    track.positions_m.emplace_back(t, 0.0);
  }
  // Due at 13.2, 14.2, 15.2, 16.2; the first samples at or after them.
  EXPECT_EQ(prediction_samples(track, 3.2, 1.0), (std::vector<std::size_t>{4, 7, 9}));
  EXPECT_TRUE(prediction_samples(track, 60.0, 1.0).empty());
  EXPECT_EQ(prediction_samples(track, 3.2, 0.0), (std::vector<std::size_t>{4, 5, 6, 7, 8, 9}));
}

TEST(Sampling, PredictionsAreDueAtTheSameSamplesAtUnixTimes) {
  const Trajectory track = testing::sampled(1000, 0.1, [](int k) { return Vector2(0.1 * k, 0.0); });
  Trajectory later = track;
  for (double& t : later.times_s) t += 1.7e9;
  for (const double stride_s : {0.2, 0.4, 1.6})
    EXPECT_EQ(prediction_samples(later, 0.4, stride_s), prediction_samples(track, 0.4, stride_s));
}

TEST(Sampling, TheFutureEndsWithTheTrack) {
  const Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  EXPECT_EQ(future(track, 50, 25, {}).size(), 25u);
  EXPECT_EQ(future(track, 90, 25, {}).size(), 5u);
  EXPECT_LT((future(track, 50, 25, {}).back() - Vector2(10, 0)).norm(), 1e-9);
}

TEST(Sampling, RejectsTracksThatBreakTheirInvariantAndMissingSamples) {
  const Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  Trajectory repeated = track, shorter = track;
  repeated.times_s[50] = repeated.times_s[49];
  shorter.positions_m.resize(50);
  const auto why = [](const Trajectory& of, std::size_t last) {
    return message_of([&] { observe(of, last, square_frame(), 3.2, {}); });
  };
  EXPECT_TRUE(says(why(track, track.times_s.size()), "last = 101, must be below 101"));
  EXPECT_TRUE(says(why({}, 0), "last = 0, must be below 0"));
  EXPECT_TRUE(says(why(shorter, 50), "must be below 50"));
  EXPECT_TRUE(says(why(repeated, 60), "sample 50: times do not increase"));
  EXPECT_EQ(why(repeated, 40), "") << "later samples are not used";
  EXPECT_THROW(companions_mps(track, 101, {}), std::invalid_argument);
}

TEST(Sampling, RejectsIntervalsAndDensitiesOutOfRange) {
  Trajectory track = testing::sampled(40, 0.1, [](int k) { return Vector2(0.1 * k, 0.0); });
  EXPECT_THROW(future(track, 40, 3, {}), std::invalid_argument);
  for (const double interval_s : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(future(track, 3, 3, {.interval_s = interval_s}), std::invalid_argument) << interval_s;
    EXPECT_THROW(resample(track, CurbFrame{}, {.interval_s = interval_s}), std::invalid_argument) << interval_s;
    EXPECT_THROW(observe(track, 39, CurbFrame{}, 3.2, {.acceleration_density = interval_s}), std::invalid_argument);
  }
  EXPECT_THROW(prediction_samples(track, 3.0, -1.0), std::invalid_argument);
  track.positions_m.resize(12);
  EXPECT_THROW(future(track, 11, 10, {}), std::invalid_argument);
}

TEST(Sampling, RejectsAWindowWithoutTimes) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  const auto expect_rejected = [](const Trajectory& of, double observe_s, double interval_s, const std::string& part) {
    const SamplingConfig config{.interval_s = interval_s};
    EXPECT_TRUE(says(message_of([&] { observe(of, 60, square_frame(), observe_s, config); }), part));
    EXPECT_TRUE(says(message_of([&] { past(of, 60, observe_s, config); }), part));
  };
  for (const double observe_s : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    expect_rejected(track, observe_s, 0.2, ": observe_s = ");
  expect_rejected(track, 3.2, 0.0, "interval_s = 0, must be positive");
  for (const double time_s : {nan, -5.0, std::numeric_limits<double>::infinity()}) {
    Trajectory wrong = track;
    wrong.times_s[60] = time_s;
    expect_rejected(wrong, 3.2, 0.2, "trajectory 'a', sample 60: time = ");
  }
  Trajectory without_begin = track;
  without_begin.times_s.front() = nan;
  expect_rejected(without_begin, 3.2, 0.2, "the first one is nan");
  EXPECT_THROW(past(track, 101, 3.2, {}), std::invalid_argument);
}

TEST(Sampling, NamesTheSampleWhosePositionIsNotFinite) {
  Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  track.positions_m[50].y() = std::numeric_limits<double>::quiet_NaN();
  const auto why = [&](std::size_t last) { return message_of([&] { observe(track, last, square_frame(), 3.2, {}); }); };
  EXPECT_TRUE(says(why(60), "sample 50: position is not finite"));
  CurbFrame without_axis;
  without_axis.axis_1 = Vector2::Zero();
  EXPECT_TRUE(says(message_of([&] { observe(track, 40, without_axis, 3.2, {}); }), "curb_frame: axis_1"));
  EXPECT_EQ(why(40), "");
}

TEST(Sampling, AOneSampleTrackStandsStill) {
  const Trajectory track{"a", {3.0}, {{1.0, 2.0}}};
  const CurbTrajectory seen = observe(track, 0, square_frame(), 3.2, {});
  ASSERT_EQ(seen.positions.size(), 1u);
  EXPECT_TRUE(seen.velocities.front().isZero());
}

}  // namespace
}  // namespace sila
