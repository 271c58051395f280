#include "sila/core/sampling.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <random>
#include <span>

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

TEST(Sampling, FitsLinesWithGaussianWeights) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(0.05, 0.15), metres(-2.0, 2.0);
  for (std::size_t samples = 2; samples < 25; ++samples) {  // registers full of samples, and what is left over
    Trajectory track{"a", {}, {}};
    for (std::size_t i = 0; i < samples; ++i) {
      track.times_s.push_back(i == 0 ? 3.0 : track.times_s.back() + step(random));
      track.positions_m.emplace_back(metres(random), metres(random));
    }
    SamplingConfig config;
    config.smoothing_s = 0.9;
    const double time_s = track.times_s[samples / 2] + 0.01;
    Eigen::MatrixXd weighted(samples, 2), wanted(samples, 2);  // root of the weight times (1, offset)
    for (std::size_t i = 0; i < samples; ++i) {
      const double offset = track.times_s[i] - time_s, root = std::exp(-0.25 * offset * offset / (0.9 * 0.9));
      weighted.row(static_cast<Eigen::Index>(i)) << root, root * offset;
      wanted.row(static_cast<Eigen::Index>(i)) = root * track.positions_m[i].transpose();
    }
    const Eigen::Matrix2d line = weighted.colPivHouseholderQr().solve(wanted);
    const MotionState state = smooth(track, std::span(&time_s, 1), samples, config).front();
    EXPECT_LT((state.position_m.transpose() - line.row(0)).norm(), 1e-9) << samples;
    EXPECT_LT((state.velocity_mps.transpose() - line.row(1)).norm(), 1e-9) << samples;
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
    cut.times_s.resize(last + 1), cut.positions_m.resize(last + 1);
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
  EXPECT_THROW(prediction_samples(track, 3.2, 0.0), std::invalid_argument);
}

TEST(Sampling, TheFutureEndsWithTheTrack) {
  const Trajectory track = walk("a", {{0, 0}, {10, 0}}, 1.0);
  EXPECT_EQ(future(track, 50, 25, {}).size(), 25u);
  EXPECT_EQ(future(track, 90, 25, {}).size(), 5u);
  EXPECT_LT((future(track, 50, 25, {}).back() - Vector2(10, 0)).norm(), 1e-9);
}

TEST(Sampling, AOneSampleTrackStandsStill) {
  const Trajectory track{"a", {3.0}, {{1.0, 2.0}}};
  const CurbTrajectory seen = observe(track, 0, square_frame(), 3.2, {});
  ASSERT_EQ(seen.positions.size(), 1u);
  EXPECT_TRUE(seen.velocities.front().isZero());
  EXPECT_THROW(smooth(track, seen.times_s, 0, {}), std::invalid_argument);
  EXPECT_THROW(smooth(track, seen.times_s, 2, {}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
