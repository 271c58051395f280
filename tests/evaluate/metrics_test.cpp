#include "sila/evaluate/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sila/refine/predictor.hpp"

namespace sila {
namespace {

using Path = std::vector<Vector2>;

TEST(ModifiedHausdorff, GivesTheWorkedExamples) {
  const Path a{{0, 0}, {1, 0}, {2, 0}}, b{{0, 1}, {1, 1}, {2, 1}, {3, 1}};
  EXPECT_NEAR(modified_hausdorff_m(a, b), 1.1035533906, 1e-10);
  EXPECT_NEAR(modified_hausdorff_m(b, a), 1.1035533906, 1e-10);
  EXPECT_NEAR(modified_hausdorff_m(Path{{0, 0}, {4, 0}}, Path{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}}), 0.8, 1e-12);
  EXPECT_EQ(modified_hausdorff_m(a, Path{{2, 0}, {1, 0}, {0, 0}}), 0.0);  // blind to order
  EXPECT_THROW(modified_hausdorff_m(a, {}), std::invalid_argument);
}

Path line_at(double y) {
  Path path;
  for (int j = 1; j <= 25; ++j) path.emplace_back(0.26 * j, y);
  return path;
}

Prediction prediction_of(const std::vector<std::pair<double, double>>& weight_and_offset) {
  Prediction prediction;
  for (const auto& [weight, offset] : weight_and_offset) {
    prediction.modes.push_back({weight, line_at(offset), std::vector<Matrix2>(25, Matrix2::Identity()), {}});
  }
  return prediction;
}

TEST(Metrics, WeighTheModesAsInThePaper) {
  const Prediction prediction = prediction_of({{.7053845127, .4}, {.2594964603, 1.2}, {.0351190270, 2.5}});
  const Metrics metrics = measure(prediction, line_at(0.0), 25);
  EXPECT_NEAR(metrics.weighted_mhd_m, .6813471249, 1e-9);
  EXPECT_NEAR(metrics.most_likely_mhd_m, .4, 1e-12);
  EXPECT_NEAR(metrics.best_mhd_m, .4, 1e-12);
  EXPECT_NEAR(metrics.ade_m, .4, 1e-12);
  EXPECT_NEAR(metrics.best_fde_m, .4, 1e-12);
  EXPECT_NEAR(metrics.mean_path_ade_m, .7053845127 * .4 + .2594964603 * 1.2 + .0351190270 * 2.5, 1e-9);
  EXPECT_NEAR(metrics.mean_path_fde_m, metrics.mean_path_ade_m, 1e-9);  // as far off at the end as on the way
  EXPECT_NEAR(metrics.mean_path_mhd_m, .7053845127 * .4 + .2594964603 * 1.2 + .0351190270 * 2.5, 1e-9);
}

TEST(Metrics, OfAnOracleAreZero) {
  const Metrics metrics = measure(prediction_of({{1.0, 0.0}}), line_at(0.0), 25);
  EXPECT_EQ(metrics.weighted_mhd_m, 0.0);
  EXPECT_EQ(metrics.mean_path_mhd_m, 0.0);
  EXPECT_EQ(metrics.ade_m, 0.0);
  EXPECT_EQ(metrics.fde_m, 0.0);
  EXPECT_NEAR(metrics.nll, std::log(2.0 * std::numbers::pi), 1e-12);
}

TEST(Metrics, TheLikelihoodIsTheMixturesDensity) {
  const Prediction prediction = prediction_of({{0.75, 0.0}, {0.25, 2.0}});
  const double expected = 0.75 * std::exp(-0.5) + 0.25 * std::exp(-0.5);  // without 2 pi
  EXPECT_NEAR(unnormalised_density(prediction, 3, line_at(1.0)[3]), expected, 1e-12);
}

TEST(Metrics, TheLikelihoodIsAveragedOverSteps) {
  Path truth = line_at(0.0);
  for (std::size_t j = 20; j < 25; ++j) truth[j].y() = 2.0;
  const Metrics metrics = measure(prediction_of({{1.0, 0.0}}), truth, 25);
  EXPECT_NEAR(metrics.nll, std::log(2.0 * std::numbers::pi) + 5.0 / 25.0 * 2.0, 1e-12);
}

TEST(Metrics, RejectATruthThatIsTooShort) {
  EXPECT_THROW(measure(prediction_of({{1.0, 0.0}}), Path(10, Vector2::Zero()), 25), std::invalid_argument);
}

TEST(Metrics, RejectRegionsOfOtherProbabilities) {
  Prediction prediction = prediction_of({{1.0, 0.0}});
  prediction.regions = {{0.25, std::vector<double>(25, 1.0)}};
  EXPECT_THROW(measure(prediction, line_at(0.0), 25), std::invalid_argument);
}

TEST(Metrics, RejectAModeThatIsTooShort) {
  Prediction prediction = prediction_of({{0.75, 0.0}, {0.25, 2.0}});
  EXPECT_THROW(mean_path(prediction, 26), std::invalid_argument);
  prediction.modes[1].path_m.resize(24);
  EXPECT_EQ(mean_path(prediction, 24).size(), 24u);
  EXPECT_THROW(measure(prediction, line_at(0.0), 25), std::invalid_argument);
}

}  // namespace
}  // namespace sila
