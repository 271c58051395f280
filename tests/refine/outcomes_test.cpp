// Probabilities of where a person will be: stays, straight, left, right, back.
#include "sila/refine/outcomes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "sila/core/sampling.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

constexpr double kPi = std::numbers::pi;

std::size_t index(Outcome outcome) {
  return static_cast<std::size_t>(outcome);
}

/// One step; of a person at (3, 2) who walks along `heading_rad`.
Prediction of_modes(std::vector<Mode> modes, double heading_rad = 0.0) {
  Prediction prediction;
  prediction.times_s = {1.0};
  prediction.modes = std::move(modes);
  prediction.start_m = {3.0, 2.0};
  prediction.heading = {std::cos(heading_rad), std::sin(heading_rad)};
  return prediction;
}

Mode gaussian(double weight, const Vector2& mean_m, const Matrix2& covariance_m2) {
  return {weight, {mean_m}, {covariance_m2}, {}};
}

Prediction random_prediction(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Mode> modes;
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    Matrix2 root;
    root << normal(random), normal(random), normal(random), normal(random);
    modes.push_back(gaussian(0.1 + uniform(random), Vector2(3.0, 2.0) + 1.5 * Vector2(normal(random), normal(random)),
                             0.5 * root * root.transpose() + 0.01 * Matrix2::Identity()));
    sum += modes.back().weight;
  }
  for (Mode& mode : modes) mode.weight /= sum;
  Prediction prediction = of_modes(std::move(modes), 2.0 * kPi * uniform(random));
  prediction.standing = uniform(random) < 0.5;
  return prediction;
}

TEST(NearestPath, SharesTheDensityByPaths) {
  const Matrix2 wide = 4.0 * Matrix2::Identity();
  // A density about the first of three paths, of which the others are 3 m to the left and to the right. Half of the way
  // to a path lies beyond 0.75 standard deviations: 22.7 % of a normal distribution.
  Prediction prediction = of_modes({gaussian(0.6, {0.0, 0.0}, wide), gaussian(0.396, {0.0, 0.0}, wide),
                                    gaussian(0.002, {0.0, 3.0}, wide), gaussian(0.002, {0.0, -3.0}, wide)});
  const std::vector<double> nearest = nearest_probabilities(prediction);
  EXPECT_NEAR(nearest[0], 1.0 - 2.0 * 0.227, 0.03);
  EXPECT_EQ(nearest[1], 0.0) << "the first mode has its path";
  EXPECT_NEAR(nearest[2], 0.227, 0.03);
  EXPECT_NEAR(nearest[3], 0.227, 0.03);
  EXPECT_NEAR(std::accumulate(nearest.begin(), nearest.end(), 0.0), 1.0, 1e-12);
  EXPECT_TRUE(nearest_probabilities({}).empty());
}

TEST(NearestPath, IsTheFrequencyAmongPathsOfTheDensity) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int trial = 0; trial < 10; ++trial) {
    const Prediction prediction = random_prediction(random);
    std::vector<double> counts(prediction.modes.size(), 0.0);
    for (const Mode& mode : prediction.modes) {
      const Matrix2 root = mode.covariances_m2[0].llt().matrixL();
      for (int i = 0; i < 4000; ++i) {
        const Vector2 point_m = mode.path_m[0] + root * Vector2(normal(random), normal(random));
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < prediction.modes.size(); ++k)
          if ((prediction.modes[k].path_m[0] - point_m).norm() < (prediction.modes[nearest].path_m[0] - point_m).norm())
            nearest = k;
        counts[nearest] += mode.weight / 4000.0;
      }
    }
    const std::vector<double> stated = nearest_probabilities(prediction);
    for (std::size_t k = 0; k < counts.size(); ++k) EXPECT_NEAR(stated[k], counts[k], 0.04);
  }
}

TEST(Outcomes, SumToOne) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    Prediction prediction = random_prediction(random);
    if (trial % 2 == 0) prediction.change_probabilities = {0.3};
    const OutcomeProbabilities p = outcome_probabilities(prediction, 0);
    EXPECT_NEAR(std::accumulate(p.begin(), p.end(), 0.0), 1.0, 1e-12);
    for (const double probability : p) EXPECT_GE(probability, 0.0);
  }
}

TEST(Outcomes, ANarrowModeHasTheOutcomeOfItsMean) {
  const Matrix2 narrow = 1e-6 * Matrix2::Identity();
  const Vector2 start_m(3.0, 2.0);
  const std::pair<Vector2, Outcome> cases[] = {
      {{0.1, -0.2}, Outcome::stays},   {{0.0, 0.45}, Outcome::stays}, {{2.0, 0.0}, Outcome::straight},
      {{2.0, 0.9}, Outcome::straight}, {{2.0, 1.0}, Outcome::left},   {{2.0, -1.0}, Outcome::right},
      {{0.0, 0.6}, Outcome::left},     {{-1.0, 1.1}, Outcome::left},  {{-1.0, 0.9}, Outcome::back},
      {{-1.0, -0.9}, Outcome::back},   {{-1.0, -1.1}, Outcome::right}};
  for (const auto& [offset_m, outcome] : cases) {
    const Prediction prediction = of_modes({gaussian(1.0, start_m + offset_m, narrow)});
    EXPECT_EQ(outcome_of(prediction, start_m + offset_m), outcome) << offset_m.transpose();
    EXPECT_EQ(outcome_probabilities(prediction, 0)[index(outcome)], 1.0) << offset_m.transpose();
  }
}

TEST(Outcomes, DirectionsOfAPersonWhoStandsAreQuarters) {
  Prediction prediction = of_modes({gaussian(1.0, {3, 2}, Matrix2::Identity())});
  prediction.standing = true;
  EXPECT_EQ(outcome_of(prediction, {5.0, 3.9}), Outcome::straight);
  EXPECT_EQ(outcome_of(prediction, {5.0, 4.1}), Outcome::left);
}

TEST(Outcomes, AWideRoundModeSharesByTheAngles) {
  const double variance_m2 = 4.0;
  const OutcomeProbabilities p =
      outcome_probabilities(of_modes({gaussian(1.0, {3, 2}, variance_m2 * Matrix2::Identity())}), 0);
  const double stays = 1.0 - std::exp(-0.5 * 0.25 / variance_m2);
  EXPECT_NEAR(p[index(Outcome::stays)], stays, 0.005);
  EXPECT_NEAR(p[index(Outcome::straight)], (1.0 - stays) * 50.0 / 360.0, 0.01);
  EXPECT_NEAR(p[index(Outcome::left)], (1.0 - stays) * 110.0 / 360.0, 0.01);
  EXPECT_NEAR(p[index(Outcome::right)], (1.0 - stays) * 110.0 / 360.0, 0.01);
  EXPECT_NEAR(p[index(Outcome::back)], (1.0 - stays) * 90.0 / 360.0, 0.01);
}

/// By a fine grid in the whitened frame of each mode: another rule than the one that is tested.
OutcomeProbabilities by_grid(const Prediction& prediction) {
  constexpr double reach = 5.0, cell = 0.02;
  OutcomeProbabilities p = {};
  for (const Mode& mode : prediction.modes) {
    const Eigen::LLT<Matrix2> factor(mode.covariances_m2[0]);
    const Matrix2 root = factor.matrixL();
    for (double x = -reach; x < reach; x += cell) {
      for (double y = -reach; y < reach; y += cell) {
        const double mass = cell * cell * std::exp(-0.5 * (x * x + y * y)) / (2.0 * kPi);
        p[index(outcome_of(prediction, mode.path_m[0] + root * Vector2(x, y)))] += mode.weight * mass;
      }
    }
  }
  return p;
}

TEST(Outcomes, AreTheIntegralOfTheDensityToAHundredth) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Prediction prediction = random_prediction(random);
    const OutcomeProbabilities p = outcome_probabilities(prediction, 0), exact = by_grid(prediction);
    for (std::size_t k = 0; k < kOutcomeCount; ++k) EXPECT_NEAR(p[k], exact[k], 0.01) << trial << ' ' << kOutcomes[k];
  }
}

TEST(Outcomes, DoNotChangeIfTheSceneIsTurnedAndShifted) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Prediction prediction = random_prediction(random);
    const Eigen::Rotation2Dd turn(0.1 + 0.06 * trial);
    const Matrix2 rotation = turn.toRotationMatrix();
    const Vector2 shift_m(17.0, -4.0);
    Prediction turned = prediction;
    for (Mode& mode : turned.modes) {
      mode.path_m[0] = rotation * mode.path_m[0] + shift_m;
      mode.covariances_m2[0] = rotation * mode.covariances_m2[0] * rotation.transpose();
    }
    turned.start_m = rotation * prediction.start_m + shift_m;
    turned.heading = rotation * prediction.heading;
    const OutcomeProbabilities p = outcome_probabilities(prediction, 0), q = outcome_probabilities(turned, 0);
    for (std::size_t k = 0; k < kOutcomeCount; ++k) EXPECT_NEAR(p[k], q[k], 1e-9) << trial;
  }
}

TEST(Outcomes, OfAMirroredSceneAreTheSame) {
  std::mt19937 random(5);
  const Matrix2 mirror = Vector2(1.0, -1.0).asDiagonal();
  double largest_difference = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    const Prediction prediction = random_prediction(random);
    Prediction mirrored = prediction;
    mirrored.mirrored = true;
    for (Mode& mode : mirrored.modes) {
      mode.path_m[0] = mirror * mode.path_m[0];
      mode.covariances_m2[0] = mirror * mode.covariances_m2[0] * mirror;
    }
    mirrored.start_m = mirror * prediction.start_m;
    mirrored.heading = mirror * prediction.heading;
    const OutcomeProbabilities p = outcome_probabilities(prediction, 0), q = outcome_probabilities(mirrored, 0);
    // The points of integration differ.
    for (std::size_t k = 0; k < kOutcomeCount; ++k) EXPECT_NEAR(p[k], q[k], 0.02) << trial;
    largest_difference = std::max(largest_difference, std::abs(p[index(Outcome::left)] - p[index(Outcome::right)]));
    for (const double y_m : {1.0, -1.0}) {
      const Vector2 position_m = prediction.start_m + Vector2(0.0, y_m);
      EXPECT_EQ(outcome_of(prediction, position_m), outcome_of(mirrored, mirror * position_m));
    }
  }
  EXPECT_GT(largest_difference, 0.2);
}

TEST(Outcomes, APersonWhoStandsStaysUnlessTheyHaveStarted) {
  std::mt19937 random(4);
  Prediction prediction = random_prediction(random);
  prediction.standing = true;
  const OutcomeProbabilities by_density = outcome_probabilities(prediction, 0);
  prediction.change_probabilities = {0.2};
  const OutcomeProbabilities p = outcome_probabilities(prediction, 0);
  EXPECT_DOUBLE_EQ(p[0], 0.8);
  for (std::size_t k = 1; k < kOutcomeCount; ++k) EXPECT_NEAR(p[k], 0.2 * by_density[k] / (1.0 - by_density[0]), 1e-12);
  prediction.standing = false;  // for people who walk the list is of stopping
  EXPECT_NE(outcome_probabilities(prediction, 0)[0], 0.8);
}

TEST(Outcomes, WithoutADirectionAllAreAlike) {
  Prediction prediction = of_modes({gaussian(1.0, {3, 2}, 1e-6 * Matrix2::Identity())});
  prediction.standing = true;
  prediction.change_probabilities = {0.4};
  const OutcomeProbabilities p = outcome_probabilities(prediction, 0);
  for (std::size_t k = 1; k < kOutcomeCount; ++k) EXPECT_DOUBLE_EQ(p[k], 0.1);
}

TEST(Outcomes, NeedAStepAPositionAndAHeading) {
  Prediction prediction = of_modes({gaussian(1.0, {3, 2}, Matrix2::Identity())});
  EXPECT_THROW(outcome_probabilities(prediction, 1), std::invalid_argument);
  EXPECT_THROW(outcome_of(prediction, {std::nan(""), 0.0}), std::invalid_argument);
  prediction.heading = Vector2::Zero();
  EXPECT_THROW(outcome_probabilities(prediction, 0), std::invalid_argument);
  EXPECT_THROW(outcome_of(prediction, {1.0, 0.0}), std::invalid_argument);
}

TEST(Outcomes, AreStatedAtWholeSecondsAndTheHorizon) {
  Prediction prediction;
  EXPECT_TRUE(outcome_steps(prediction).empty());
  for (int j = 1; j <= 12; ++j) prediction.times_s.push_back(0.2 * j);
  EXPECT_EQ(outcome_steps(prediction), (std::vector<std::size_t>{4, 9, 11}));
  prediction.times_s = {0.3, 0.6, 0.9, 1.2};
  EXPECT_EQ(outcome_steps(prediction), (std::vector<std::size_t>{2, 3}));
  prediction.times_s = {0.4};
  EXPECT_EQ(outcome_steps(prediction), (std::vector<std::size_t>{0}));
}

TEST(Outcomes, OfALongerHorizonBeginAsThoseOfAShorterOne) {
  EpisodeConfig config;
  const Model model = testing::learnt(testing::corner_walks(40, 21));
  RefineConfig shorter = config.predict;
  shorter.horizon_s = 3.0;
  const Predictor near(model, shorter), far(model, config.predict);
  int compared = 0;
  for (const Window& window : windows_of(testing::corner_walks(5, 99), config.sampling, config.predict, 2.0)) {
    const Prediction a = near.predict(window.observed), b = far.predict(window.observed);
    EXPECT_NEAR(a.heading.norm(), 1.0, 1e-12);
    for (const std::size_t step : outcome_steps(a)) {
      EXPECT_EQ(outcome_probabilities(a, step), outcome_probabilities(b, step));
      ++compared;
    }
  }
  EXPECT_GT(compared, 10);
}

/// The last y of the mode of a variant.
double sideways_m(const Prediction& prediction, VariantKind variant) {
  return std::ranges::find(prediction.modes, variant, &Mode::variant)->path_m.back().y();
}

TEST(Outcomes, AWalkerGoesStraightOnAndAStanderStays) {
  EpisodeConfig config;
  const Model model = testing::learnt(testing::corner_walks(40, 21));
  const Predictor predictor(model, config.predict);
  const Trajectory walker = testing::walk("walks", {{14, 1}, {6, 1}}, 1.3);
  const Prediction walks =
      predictor.predict(observe(walker, walker.times_s.size() - 1, testing::square_frame(), 3.2, {}));
  EXPECT_NEAR(walks.heading.x(), -1.0, 1e-3);
  EXPECT_GT(outcome_probabilities(walks, 4)[index(Outcome::straight)], 0.9);
  EXPECT_FALSE(walks.mirrored);
  CurbFrame mirrored = testing::square_frame();
  std::swap(mirrored.axis_1, mirrored.axis_2);
  const Prediction in_image = predictor.predict(observe(walker, walker.times_s.size() - 1, mirrored, 3.2, {}));
  EXPECT_TRUE(in_image.mirrored);
  EXPECT_LT(sideways_m(walks, VariantKind::left), sideways_m(walks, VariantKind::right));
  EXPECT_GT(sideways_m(in_image, VariantKind::left), sideways_m(in_image, VariantKind::right));
  Trajectory stander = walker;
  for (Vector2& position_m : stander.positions_m) position_m = {2.0, 2.0};
  const Prediction stands =
      predictor.predict(observe(stander, stander.times_s.size() - 1, testing::square_frame(), 3.2, {}));
  EXPECT_TRUE(stands.standing);
  EXPECT_EQ(stands.heading, testing::square_frame().axis_1);
  EXPECT_EQ(outcome_probabilities(stands, 4)[0], 1.0 - stands.change_probabilities[4]);
}

}  // namespace
}  // namespace sila
