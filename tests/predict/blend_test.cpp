#include "sila/predict/blend.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sila {
namespace {

constexpr int kSteps = 3;
constexpr int kTaughtClass = 3, kOtherClass = 1;
constexpr double kInterval_s = 0.2;

template <int F>
Eigen::VectorXd coefficients(std::initializer_list<std::pair<int, double>> entries) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(F);
  for (const auto& [index, value] : entries) all[index] = value;
  return all;
}

Lessons nothing_taught() {
  Lessons lessons;
  lessons.steps = kSteps, lessons.classes = kSpeedClasses, lessons.interval_s = kInterval_s;
  const std::size_t cells = kSteps * kSpeedClasses;
  const auto none = [](int f) { return RegressionMoments{0.0, Eigen::MatrixXd::Zero(f, f), Eigen::VectorXd::Zero(f)}; };
  lessons.without_map.assign(cells, none(kAloneFeatures));
  lessons.with_map.assign(cells, none(kMapFeatures));
  lessons.residuals_without_map.resize(cells);
  lessons.residuals_with_map.resize(cells);
  lessons.residuals_place_free.resize(cells);
  return lessons;
}

Features random_features(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  Features features(2, count);
  for (Eigen::Index i = 0; i < features.size(); ++i) features.data()[i] = normal(random);
  return features;
}

/// So many examples at every step of people of one class who move just as `truth` says.
void teach(std::vector<RegressionMoments>& moments, std::vector<ResidualMoments>& residuals, int speed_class, int count,
           const Eigen::VectorXd& truth) {
  std::mt19937 random(7);
  for (std::size_t step = 0; step < kSteps; ++step) {
    const std::size_t cell = step * kSpeedClasses + static_cast<std::size_t>(speed_class);
    const double seconds = static_cast<double>(step + 1) * kInterval_s;
    for (int i = 0; i < count; ++i) {
      const Features features = random_features(random, static_cast<int>(truth.size()));
      moments[cell] += {1.0, features.transpose() * features, features.transpose() * (features * truth)};
      residuals[cell] += {1.0, 0.01 * seconds * seconds, 0.01 * seconds * seconds};
    }
  }
}

/// The largest difference between the blend and a sum of features with these coefficients, over some features.
double distance(const Blend& blend, int speed_class, const Eigen::VectorXd& expected) {
  std::mt19937 random(8);
  double largest = 0.0;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const Features features = random_features(random, static_cast<int>(expected.size()));
    const Vector2 difference = blend.velocity_mps(features, step, speed_class) - features * expected;
    largest = std::max(largest, difference.norm());
  }
  return largest;
}

const Eigen::VectorXd kUntaught = coefficients<kAloneFeatures>({{kPlaceFreeFeatures, 1.0}});
const Eigen::VectorXd kTruth = coefficients<kAloneFeatures>({{0, 0.3}, {3, 0.5}});

TEST(Blend, BelievesTheOutlooksBeforeAnythingWasTaught) {
  EXPECT_LT(distance(Blend(nothing_taught(), {}), kTaughtClass, kUntaught), 1e-12);
}

TEST(Blend, LearnsWhatManyExamplesShow) {
  Lessons lessons = nothing_taught();
  teach(lessons.without_map, lessons.residuals_without_map, kTaughtClass, 3000, kTruth);
  EXPECT_LT(distance(Blend(lessons, {}), kTaughtClass, kTruth), 0.01);
}

TEST(Blend, AClassOfWhichNothingWasSeenDoesAsTheOthers) {
  Lessons lessons = nothing_taught();
  teach(lessons.without_map, lessons.residuals_without_map, kTaughtClass, 3000, kTruth);
  EXPECT_LT(distance(Blend(lessons, {}), kOtherClass, kTruth), 0.01);
}

TEST(Blend, AClassPartsFromTheOthersWhenItWasSeenOften) {
  Lessons lessons = nothing_taught();
  const Eigen::VectorXd own = coefficients<kAloneFeatures>({{1, 0.8}});
  teach(lessons.without_map, lessons.residuals_without_map, kTaughtClass, 3000, kTruth);
  teach(lessons.without_map, lessons.residuals_without_map, kOtherClass, 3, own);
  EXPECT_GT(distance(Blend(lessons, {}), kOtherClass, own), 0.1);  // three examples against the experience with others
  teach(lessons.without_map, lessons.residuals_without_map, kOtherClass, 3000, own);
  EXPECT_LT(distance(Blend(lessons, {}), kOtherClass, own), 0.01);
}

TEST(Blend, RollOutsCountOnceTheyWereRight) {
  Lessons lessons = nothing_taught();
  teach(lessons.without_map, lessons.residuals_without_map, kTaughtClass, 3000, kTruth);
  Eigen::VectorXd without_roll_out = Eigen::VectorXd::Zero(kMapFeatures);
  without_roll_out.head(kAloneFeatures) = kTruth;
  EXPECT_LT(distance(Blend(lessons, {}), kTaughtClass, without_roll_out), 0.01);
  const Eigen::VectorXd with_roll_out = coefficients<kMapFeatures>({{0, 0.2}, {kAloneFeatures, 0.7}});
  teach(lessons.with_map, lessons.residuals_with_map, kTaughtClass, 3000, with_roll_out);
  EXPECT_LT(distance(Blend(lessons, {}), kTaughtClass, with_roll_out), 0.01);
}

}  // namespace
}  // namespace sila
