#include "refine/regions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "refine/mode_variants.hpp"
#include "sila/refine/predictor.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

Prediction one_mode(const Matrix2& covariance) {
  Prediction prediction;
  prediction.times_s = {0.2};
  prediction.modes.push_back({1.0, {Vector2(3.0, -1.0)}, {covariance}, {}});
  return prediction;
}

Matrix2 tilted() {
  Matrix2 covariance;
  covariance << 2.0, 0.6, 0.6, 0.5;
  return covariance;
}

TEST(Nonconformity, OfOneModeIsHalfTheSquaredMahalanobisDistance) {
  const Prediction prediction = one_mode(tilted());
  const Vector2 off(0.7, 1.1);
  EXPECT_NEAR(nonconformity(prediction, 0, Vector2(3.0, -1.0) + off), 0.5 * off.dot(tilted().inverse() * off), 1e-12);
  EXPECT_EQ(nonconformity(prediction, 0, {3.0, -1.0}), 0.0);
  EXPECT_TRUE(std::isfinite(nonconformity(prediction, 0, {1e6, 1e6})));
  EXPECT_THROW(nonconformity(prediction, prediction.times_s.size(), {3.0, -1.0}), std::invalid_argument);
  for (const double far : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(says(message_of([&] { nonconformity(prediction, 0, {1.0, far}); }), "point_m = (1, "));
    EXPECT_THROW(unnormalised_density(prediction, 0, {far, 1.0}), std::invalid_argument);
  }
}

constexpr std::size_t kHalf = 1, kNineTenths = 3;
static_assert(kRegionProbabilities[kHalf] == 0.5 && kRegionProbabilities[kNineTenths] == 0.9);

TEST(Calibration, WithoutErrorStatisticsIsThatOfAGaussian) {
  const Calibration calibration{ErrorStatistics{}};
  EXPECT_NEAR(calibration.level(7, 2, kHalf), std::log(2.0), 1e-12);
  EXPECT_EQ(calibration.novelty(0.3), 0.3);
}

ErrorStatistics error_statistics_with(int surprising_bin, double windows) {
  ErrorStatistics error_statistics;
  error_statistics.steps = 1;
  error_statistics.scores.assign(kScoreClasses, std::vector<double>(kScoreBins, 0.0));
  error_statistics.scores[3][static_cast<std::size_t>(surprising_bin)] = windows;
  error_statistics.novelties.assign(kNoveltyBins, 0.0);
  error_statistics.novelties[0] = 0.75 * windows;
  error_statistics.novelties[25] = 0.25 * windows;
  return error_statistics;
}

TEST(Calibration, LevelsFollowWhatHappened) {
  const int bin = score_bin(4.0);
  const Calibration calibration(error_statistics_with(bin, 1e6));
  EXPECT_EQ(score_bin(calibration.level(0, 3, kHalf)), bin);
  EXPECT_EQ(score_bin(calibration.level(0, 3, kNineTenths)), bin);
  EXPECT_LT(calibration.level(0, 3, kHalf), calibration.level(0, 3, kNineTenths));
  // A class that was never seen takes the word of the others.
  EXPECT_EQ(score_bin(calibration.level(0, 1, kHalf)), bin);
}

TEST(Calibration, OfAFewWindowsStaysNearThePrior) {
  const Calibration none(error_statistics_with(0, 0.0)), few(error_statistics_with(score_bin(20.0), 2.0));
  EXPECT_NEAR(none.level(0, 3, kHalf), 2.0 * std::log(2.0), 0.1);  // wider than those of a Gaussian
  EXPECT_NEAR(none.level(0, 3, kNineTenths), 2.0 * std::log(10.0), 0.2);
  EXPECT_LT(few.level(0, 3, kHalf), none.level(0, 3, kHalf) + 1.0);
}

TEST(Calibration, ExpectsLargerScoresOfPeopleWhoStand) {
  const Calibration calibration(error_statistics_with(score_bin(0.5), 1e6));
  EXPECT_NEAR(calibration.level(0, 0, kHalf), 4.5 * std::log(2.0), 0.2);
  EXPECT_GT(calibration.level(0, 0, kNineTenths), 4.0 * calibration.level(0, 1, kNineTenths));
}

TEST(Calibration, NoveltyIsTheShareThatWasBetterKnown) {
  const Calibration calibration(error_statistics_with(3, 100.0));
  EXPECT_EQ(calibration.novelty(0.0), 0.0);
  EXPECT_NEAR(calibration.novelty(0.3), 0.75, 1e-12);
  EXPECT_NEAR(calibration.novelty(1.0), 1.0, 1e-12);
}

/// Makes the prediction one mode that goes straight on.
void go_straight(Workspace& workspace, double weight) {
  workspace.prediction.times_s = {0.2, 0.4};
  add_mode(workspace, weight);
  workspace.prediction.modes[0].path_m = {Vector2(1.2, 2.0), Vector2(1.4, 2.0)};
  workspace.prediction.modes[0].covariances_m2 = {Matrix2::Identity(), Matrix2::Identity()};
}
const ErrorDensity kUnseen(zero_error_statistics(2, 0.2, 3.2).density[kWalking], 2, 0.2);
const ComponentWeights kWeights = kUnseen.scale(ScaleFeatures::Zero()).weights;

TEST(ModeVariants, KeepWeightAndMeanOfTheirMode) {
  Workspace workspace;
  go_straight(workspace, 0.8);
  const ErrorScale scale{{1.0, 4.0}, kWeights};
  add_variants(workspace, kUnseen, scale, {1.0, 2.0}, {});
  double weight = 0.0;
  Vector2 mean = Vector2::Zero();
  for (const Mode& mode : workspace.prediction.modes) {
    weight += mode.weight;
    mean += mode.weight * mode.path_m[1];
  }
  ASSERT_EQ(workspace.prediction.modes.size(), 6u);
  EXPECT_NEAR(weight, 0.8, 1e-12);
  EXPECT_LT((mean / weight - Vector2(1.4, 2.0)).norm(), 1e-12);
  const std::vector<VariantKind> kinds = {VariantKind::slower, VariantKind::left, VariantKind::faster,
                                          VariantKind::faster, VariantKind::right};
  for (std::size_t k = 0; k < kinds.size(); ++k) EXPECT_EQ(workspace.prediction.modes[k + 1].variant, kinds[k]);
  const Vector2 deviation_m = kUnseen.total_variances_m2(1, scale).cwiseSqrt();
  EXPECT_NEAR(workspace.prediction.modes[1].path_m[1].x(), 1.4 - deviation_m.x(), 1e-12);
  EXPECT_NEAR(workspace.prediction.modes[2].path_m[1].y(), 2.0 + std::sin(0.4 * std::numbers::pi) * deviation_m.y(),
              1e-12);
}

TEST(ModeVariants, AreAtLeastTwoAndOnlyWhereThereIsRoom) {
  for (const auto& [max_modes, modes] :
       {std::pair(3, 1u), std::pair(4, 1u), std::pair(5, 3u), std::pair(6, 4u), std::pair(100, 6u)}) {
    RefineConfig config;
    config.max_modes = max_modes;
    Workspace workspace;
    go_straight(workspace, 1.0);
    add_variants(workspace, kUnseen, {{1.0, 1.0}, kWeights}, {1.0, 2.0}, config);
    EXPECT_EQ(workspace.prediction.modes.size(), modes) << max_modes;
  }
  RefineConfig none;
  none.mode_variants = 0;
  Workspace workspace;
  go_straight(workspace, 1.0);
  add_variants(workspace, kUnseen, {{1.0, 1.0}, kWeights}, {1.0, 2.0}, none);
  EXPECT_EQ(workspace.prediction.modes.size(), 1u);
}

double held_within_reach(const ComponentWeights& weights, std::size_t step, const ErrorScale& scale) {
  double sum = 0.0;
  for (std::size_t c = 0; c < kMixtureComponents; ++c)
    sum += weights[c] * (1.0 - std::exp(-0.125 / kUnseen.variances_m2(c, step, scale).mean()));
  return sum;
}

TEST(StandingWeights, AreHalfwayToThoseThatHoldTheProbabilityOfStaying) {
  constexpr std::size_t step = 17;
  const ErrorScale scale{{0.5, 1.0}, kWeights};
  const double untilted = held_within_reach(kWeights, step, scale);
  for (const double stays : {0.3, 0.5, 0.7}) {
    const ComponentWeights weights = standing_weights(kUnseen, step, scale, stays);
    EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1.0, 1e-12);
    EXPECT_NEAR(held_within_reach(weights, step, scale), 0.5 * (untilted + stays), 1e-3) << stays;
  }
}

TEST(StandingWeights, AreThoseOfTheDensityWhereItsComponentsAreAlike) {
  const ErrorScale narrow{Vector2::Constant(1e-6), kWeights};  // all within reach
  EXPECT_EQ(standing_weights(kUnseen, 3, narrow, 0.5), kWeights);
}

}  // namespace
}  // namespace sila
