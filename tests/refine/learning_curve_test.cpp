#include "sila/refine/learning_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace sila {
namespace {

/// Batches of 20 tracks whose relative errors are .7 + .5 / sqrt(n) and `noise` times a normal deviate.
std::vector<LearningPoint> made_up(std::size_t episodes, double noise, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> deviate;
  std::vector<LearningPoint> points;
  for (std::size_t i = 1; i <= episodes; ++i) {
    const double tracks = 20.0 * static_cast<double>(i), ratio = 0.7 + 0.5 / std::sqrt(tracks);
    const std::size_t windows = 50 + 10 * (i % 3);
    const double scale_m = static_cast<double>(windows) * 1.5;
    const double error = noise / std::sqrt(static_cast<double>(windows)) * deviate(random);
    points.push_back({tracks, {windows, scale_m * (ratio + error), scale_m}});
  }
  return points;
}

TEST(LearningCurve, FindsTheCurveThatPointsLieOn) {
  const auto curve = fit_learning_curve(made_up(6, 0.0));
  ASSERT_TRUE(curve);
  EXPECT_EQ(curve->points, 6);
  EXPECT_NEAR(curve->coefficients[0], 0.7, 1e-9);
  EXPECT_NEAR(curve->coefficients[1], 0.5, 1e-9);
  const Estimate expected = expected_error(*curve, 400.0);
  EXPECT_NEAR(expected.value, 0.725, 1e-9);
  EXPECT_NEAR(expected.upper - expected.lower, 0.0, 1e-6);
}

TEST(LearningCurve, NineOfTenIntervalsHoldTheTruth) {
  for (std::size_t episodes : {4u, 30u}) {
    int held = 0;
    for (unsigned seed = 0; seed < 1000; ++seed) {
      const Estimate expected = expected_error(*fit_learning_curve(made_up(episodes, 0.3, seed)), 900.0);
      held += expected.lower <= 0.7 + 0.5 / 30.0 && 0.7 + 0.5 / 30.0 <= expected.upper ? 1 : 0;
    }
    EXPECT_NEAR(held, 900, 30) << episodes;
  }
}

TEST(LearningCurve, NeedsFourDifferentPointsWithWindows) {
  EXPECT_FALSE(fit_learning_curve({}));
  EXPECT_FALSE(fit_learning_curve(made_up(3, 0.1)));
  std::vector<LearningPoint> points = made_up(4, 0.1);
  EXPECT_TRUE(fit_learning_curve(points));
  points.insert(points.begin(), LearningPoint{});  // as the first batch
  EXPECT_EQ(fit_learning_curve(points)->points, 4);
  points[2].error = {};
  EXPECT_FALSE(fit_learning_curve(points));
  points = made_up(4, 0.1);
  for (LearningPoint& point : points) point.tracks = 20.0;
  EXPECT_FALSE(fit_learning_curve(points));
}

TEST(LearningCurve, RejectsWhatIsNoError) {
  const auto with = [](LearningPoint bad) {
    std::vector<LearningPoint> points = made_up(4, 0.1);
    points.push_back(bad);
    return fit_learning_curve(points);
  };
  EXPECT_THROW(with({0.0, {10, 1.0, 1.0}}), std::invalid_argument);
  EXPECT_THROW(with({20.0, {10, -1.0, 1.0}}), std::invalid_argument);
  EXPECT_THROW(with({20.0, {10, 1.0, std::numeric_limits<double>::quiet_NaN()}}), std::invalid_argument);
  EXPECT_THROW(expected_error(*fit_learning_curve(made_up(4, 0.1)), 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace sila
