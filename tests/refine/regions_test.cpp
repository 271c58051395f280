#include "sila/refine/regions.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sila/refine/mode_variants.hpp"
#include "sila/refine/stacking.hpp"

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
}

constexpr std::size_t kHalf = 1, kNineTenths = 3;
static_assert(kRegionProbabilities[kHalf] == 0.5 && kRegionProbabilities[kNineTenths] == 0.9);

TEST(Calibration, WithoutErrorStatisticsSpeaksOfAGaussian) {
  const Calibration calibration{ErrorStatistics{}};
  EXPECT_FALSE(calibration.fitted());
  EXPECT_NEAR(calibration.level(7, 2, kHalf), std::log(2.0), 1e-12);
  EXPECT_EQ(calibration.novelty(0.3), 0.3);
}

ErrorStatistics error_statistics_with(int surprising_bin, double windows) {
  ErrorStatistics error_statistics;
  error_statistics.steps = 1, error_statistics.classes = kSpeedClasses;
  error_statistics.scores.assign(kSpeedClasses, std::vector<double>(kScoreBins, 0.0));
  error_statistics.scores[3][static_cast<std::size_t>(surprising_bin)] = windows;
  error_statistics.novelties.assign(kNoveltyBins, 0.0);
  error_statistics.novelties[0] = 0.75 * windows, error_statistics.novelties[25] = 0.25 * windows;
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

TEST(Calibration, OfAFewWindowsStaysNearTheGaussian) {
  const Calibration calibration(error_statistics_with(score_bin(20.0), 2.0));
  EXPECT_LT(calibration.level(0, 3, kHalf), 1.5);
}

TEST(Calibration, NoveltyIsTheShareThatWasBetterKnown) {
  const Calibration calibration(error_statistics_with(3, 100.0));
  EXPECT_EQ(calibration.novelty(0.0), 0.0);
  EXPECT_NEAR(calibration.novelty(0.3), 0.75, 1e-12);
  EXPECT_NEAR(calibration.novelty(1.0), 1.0, 1e-12);
}

TEST(ModeVariants, KeepTheMeanAndTheCovarianceOfTheirMode) {
  PredictConfig config;
  config.variant_weight = 0.05;
  const Vector2 start(1.0, 2.0), way(2.0, 1.0);
  const Mode mode{0.8, {start + way}, {oriented_covariance(way, {1.5, 0.4})}, {4}};
  std::vector<Mode> modes(5, mode);
  split_into_variants(modes, start, config);
  double weight = 0.0;
  Vector2 mean = Vector2::Zero();
  for (const Mode& part : modes) weight += part.weight, mean += part.weight * part.path_m[0];
  EXPECT_NEAR(weight, 0.8, 1e-12);
  EXPECT_LT((mean / weight - mode.path_m[0]).norm(), 1e-12);
  Matrix2 covariance = Matrix2::Zero();
  for (const Mode& part : modes) {
    const Vector2 off = part.path_m[0] - mode.path_m[0];
    covariance += part.weight / weight * (part.covariances_m2[0] + off * off.transpose());
  }
  EXPECT_LT((covariance - mode.covariances_m2[0]).norm(), 1e-12);
  EXPECT_EQ(modes[1].variant, VariantKind::slower);
  EXPECT_LT((modes[1].path_m[0] - start).norm(), way.norm());
}

TEST(ModeVariants, ComeInPairsAndOnlyWhereThereIsRoom) {
  EXPECT_EQ(count_variants(-1, {}), 0);
  EXPECT_EQ(count_variants(1, {}), 0);
  EXPECT_EQ(count_variants(3, {}), 2);
  EXPECT_EQ(count_variants(100, {}), 4);
  PredictConfig none;
  none.mode_variants = 0;
  EXPECT_EQ(count_variants(5, none), 0);
  std::vector<Mode> same(1, Mode{1.0, {Vector2(1, 0)}, {Matrix2::Identity()}, {}});
  split_into_variants(same, {0, 0}, none);
  EXPECT_EQ(same[0].weight, 1.0);
}

}  // namespace
}  // namespace sila
