#include "sila/eval/coverage.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace sila {
namespace {

Prediction of_modes(const std::vector<std::pair<double, Vector2>>& modes, const Matrix2& covariance_m2) {
  Prediction prediction;
  prediction.times_s = {1.0};
  for (const auto& [weight, mean_m] : modes) prediction.modes.push_back({weight, {mean_m}, {covariance_m2}, {}});
  return prediction;
}

TEST(Coverage, OfOneModeIsThatOfItsEllipse) {
  Matrix2 covariance;
  covariance << 4.0, 1.0, 1.0, 2.0;
  const Prediction prediction = of_modes({{1.0, {1.0, 2.0}}}, covariance);
  const Vector2 truth_m = Vector2(1.0, 2.0) + Vector2(covariance.llt().matrixL() * Vector2(std::sqrt(2.0), 0.0));
  EXPECT_NEAR(mass_above(prediction, 0, truth_m), 1.0 - std::exp(-1.0), 1e-12);
  EXPECT_EQ(mass_above(prediction, 0, {1.0, 2.0}), 0.0);
}

TEST(Coverage, OfTwoEqualModesIsThatOfOne) {
  const Matrix2 covariance = 0.5 * Matrix2::Identity();
  const Prediction one = of_modes({{1.0, {0, 0}}}, covariance);
  const Prediction two = of_modes({{0.3, {0, 0}}, {0.7, {0, 0}}}, covariance);
  for (double x : {0.1, 0.5, 1.0, 1.7}) EXPECT_NEAR(mass_above(two, 0, {x, 0}), mass_above(one, 0, {x, 0}), 0.03) << x;
}

TEST(Coverage, OfTwoModesFarApartRanksThemByTheirDensity) {
  const Prediction prediction = of_modes({{0.8, {0, 0}}, {0.2, {100, 0}}}, Matrix2::Identity());
  // At the middle of the lighter mode only that part of the heavier one is denser whose density is over a quarter.
  EXPECT_NEAR(mass_above(prediction, 0, {100, 0}), 0.8 * (1.0 - 0.25), 0.02);
  EXPECT_NEAR(mass_above(prediction, 0, {50, 0}), 1.0, 1e-9);
}

TEST(Coverage, IsUniformWhereTruthsAreDrawnFromThePrediction) {
  const Prediction prediction = of_modes({{0.6, {0, 0}}, {0.4, {2, 1}}}, Matrix2::Identity());
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  constexpr int kDraws = 4000;
  int half = 0, ninety = 0;
  for (int k = 0; k < kDraws; ++k) {
    const Vector2 mean_m = prediction.modes[uniform(random) < 0.6 ? 0 : 1].path_m[0];
    const double mass = mass_above(prediction, 0, mean_m + Vector2(normal(random), normal(random)));
    half += mass <= 0.5, ninety += mass <= 0.9;
  }
  EXPECT_NEAR(half / double{kDraws}, 0.5, 0.03);  // 4 standard deviations of the draws: 0.032 and 0.019
  EXPECT_NEAR(ninety / double{kDraws}, 0.9, 0.02);
}

TEST(Coverage, RefusesAStepBeyondThePrediction) {
  EXPECT_THROW(mass_above(of_modes({{1.0, {0, 0}}}, Matrix2::Identity()), 1, {0, 0}), std::invalid_argument);
  EXPECT_THROW(mass_above({}, 0, {0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
