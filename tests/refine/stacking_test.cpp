#include "refine/stacking.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/kinematics.hpp"
#include "model/parts.hpp"
#include "sila/core/sampling.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

constexpr int kSteps = 3;
constexpr int kFittedClass = 3, kOtherClass = 1;
constexpr double kInterval_s = 0.2;

template <int F>
Eigen::VectorXd coefficients(std::initializer_list<std::pair<int, double>> entries) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(F);
  for (const auto& [index, value] : entries) all[index] = value;
  return all;
}

PersonClass of_class(int speed) {
  return {speed, {}, 0};
}

ErrorStatistics nothing_fitted() {
  return zero_error_statistics(kSteps, kInterval_s, 3.2);
}

Features random_features(std::mt19937& random, int count) {
  std::normal_distribution<double> normal;
  Features features(2, count);
  for (Eigen::Index i = 0; i < features.size(); ++i) features.data()[i] = normal(random);
  return features;
}

/// Adds examples of one class at every step, as precise as given [s^2/m^2], of pedestrians who move as `truth` says.
void add_examples(ErrorStatistics& error_statistics, int speed_class, int count, const Eigen::VectorXd& truth,
                  double precision = 10.0) {
  std::mt19937 random(7);
  error_statistics.density[motion_state(speed_class)].scale.weight += count;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const std::size_t cell = step * kSpeedClasses + static_cast<std::size_t>(speed_class);
    for (int i = 0; i < count; ++i) {
      const Features features = random_features(random, static_cast<int>(truth.size()));
      sila::add_examples(error_statistics.stacking[cell], features.transpose(), features * truth, precision);
    }
  }
}

/// The largest difference between stacking and a sum of features with these coefficients, over some features.
double distance(const Stacking& stacking, int speed_class, const Eigen::VectorXd& expected) {
  std::mt19937 random(8);
  double largest = 0.0;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const Features features = random_features(random, static_cast<int>(expected.size()));
    const Vector2 difference = stacking.stacked_mps(features, step, of_class(speed_class)) - features * expected;
    largest = std::max(largest, difference.norm());
  }
  return largest;
}

const Eigen::VectorXd kUnfitted =
    coefficients<kStackedFeatures>({{kConstantVelocityFeature, 0.2}, {kStackedFeatures - 1, 0.8}});
const Eigen::VectorXd kTruth = coefficients<kStackedFeatures>({{0, 0.3}, {3, 0.5}});

TEST(Stacking, BelievesTheResidualsBeforeAnythingWasSeen) {
  EXPECT_LT(distance(Stacking(nothing_fitted(), {}), kFittedClass, kUnfitted), 1e-12);
}

TEST(Stacking, PeopleWhoHardlyMoveTakeTheChoiceOfLeastError) {
  ErrorStatistics error_statistics = nothing_fitted();
  error_statistics.slow.assign(kSlowClasses, {100.0, {}});
  std::mt19937 random(9);
  const Features features = random_features(random, kStackedFeatures);
  ObservedFeatures seen;
  seen.person.slow = 1;
  for (std::size_t best = 0; best < std::size(kSlowChoices); ++best) {
    error_statistics.slow[1].errors_m.fill(2.0);
    error_statistics.slow[1].errors_m[best] = 1.0;
    const Stacking stacking(error_statistics, {});
    const Vector2 expected = kSlowChoices[best].constant_velocity * features.col(kConstantVelocityFeature) +
                             kSlowChoices[best].stacked * stacking.stacked_mps(features, 1, {});
    EXPECT_LT((stacking.velocity_mps(features, 1, seen) - expected).norm(), 1e-12);
  }
  error_statistics.slow[1].weight = 3.0;  // of too few windows nothing is concluded
  EXPECT_LT((Stacking(error_statistics, {}).velocity_mps(features, 1, seen) - 0.5 * features.col(1)).norm(), 1e-12);
}

TEST(Stacking, LearnsWhatManyExamplesShowAlsoForAClassWithoutAny) {
  ErrorStatistics error_statistics = nothing_fitted();
  add_examples(error_statistics, kFittedClass, 3000, kTruth);
  for (const int speed_class : {kFittedClass, kOtherClass})
    EXPECT_LT(distance(Stacking(error_statistics, {}), speed_class, kTruth), 0.01) << speed_class;
}

TEST(Stacking, BelievesFewWindowsLess) {
  const auto error_after = [](int count, double windows) {
    ErrorStatistics error_statistics = nothing_fitted();
    add_examples(error_statistics, kFittedClass, count, kTruth);
    error_statistics.density[kWalking].scale.weight = windows;
    return distance(Stacking(error_statistics, {}), kFittedClass, kTruth);
  };
  EXPECT_GT(error_after(10, 5.0), 1.5 * error_after(10, 1000.0));
}

TEST(Stacking, APersonWhoStandsBeforeANoisyTrackerDoesNotWalk) {
  const auto position_at = [](int i) { return Vector2(0.15 * std::sin(2.0 * M_PI * 0.1 * i / 0.8), 0.0); };
  const Trajectory standing = testing::sampled(33, 0.1, position_at);
  const CurbTrajectory observed = observe(standing, 32, testing::square_frame(), 3.2, {});
  EXPECT_GT(mean_speed_mps(observed), kSpeedClassLimits_mps[0]);
  EXPECT_EQ(person_class(observed, 3.2).speed, 0);
  const Trajectory walking = testing::walk("y", {{0, 0}, {20, 0}}, 0.5);
  EXPECT_EQ(person_class(observe(walking, 32, testing::square_frame(), 3.2, {}), 3.2).speed, 1);
}

TEST(Stacking, APersonWhoWalkedThereAndBackWalks) {
  const Trajectory path = testing::walk("x", {{0, 0}, {1.6, 0}, {-9, 0}}, 1.0);
  const CurbTrajectory observed = observe(path, 32, testing::square_frame(), 3.2, {});
  EXPECT_LT((observed.positions.back() - observed.positions.front()).norm(), 0.3);
  EXPECT_EQ(person_class(observed, 3.2).speed, 2);
}

TEST(Stacking, PeopleWhoStandDoNotMoveTheRegressionOfThoseWhoWalk) {
  ErrorStatistics error_statistics = nothing_fitted();
  add_examples(error_statistics, kFittedClass, 300, kTruth);
  const Stacking alone(error_statistics, {});
  add_examples(error_statistics, 0, 300, coefficients<kStackedFeatures>({{1, 0.8}}), 1e6);
  const Stacking both(error_statistics, {});
  std::mt19937 random(8);
  const Features features = random_features(random, kStackedFeatures);
  EXPECT_EQ(both.stacked_mps(features, 0, of_class(kOtherClass)),
            alone.stacked_mps(features, 0, of_class(kOtherClass)));
  EXPECT_EQ(both.stacked_mps(features, 0, of_class(kFittedClass)),
            alone.stacked_mps(features, 0, of_class(kFittedClass)));
  EXPECT_NE(both.stacked_mps(features, 0, {}), alone.stacked_mps(features, 0, {}));
}

TEST(Stacking, OfLessObservedUsesTheFeaturesThatThereAre) {
  ErrorStatistics error_statistics = nothing_fitted();
  add_examples(error_statistics, kFittedClass, 3000, kTruth);
  const Stacking stacking(error_statistics, {});
  std::mt19937 random(8);
  Features features = random_features(random, kStackedFeatures);
  const PersonClass appeared{
      kFittedClass, {}, 3};  // 0.4 s before: the features are independent, so what is known counts as before
  const Eigen::VectorXd known = coefficients<kStackedFeatures>({{0, 0.3}});
  EXPECT_LT((stacking.stacked_mps(features, 0, appeared) - features * known).norm(), 0.1);
  const Vector2 before = stacking.stacked_mps(features, 0, appeared);
  for (int missing : {1, 2, 3, 5, 6}) features.col(missing).setConstant(100.0);  // mean velocities over 0.8 s and more
  EXPECT_EQ(stacking.stacked_mps(features, 0, appeared), before);
}

TEST(Stacking, KnowsHowMuchWasObserved) {
  const Trajectory track = testing::walk("x", {{0, 0}, {20, 0}}, 1.3);
  const auto observed = [&](double seconds, double observe_s) {
    const auto last = static_cast<std::size_t>(std::lround(seconds / 0.1));
    return person_class(observe(track, last, testing::square_frame(), observe_s, {}), observe_s).observed;
  };
  EXPECT_EQ(observed(0.1, 3.2), 3u);
  EXPECT_EQ(observed(0.4, 3.2), 3u);
  EXPECT_EQ(observed(0.8, 3.2), 2u);
  EXPECT_EQ(observed(1.4, 3.2), 2u);
  EXPECT_EQ(observed(1.6, 3.2), 1u);
  EXPECT_EQ(observed(2.9, 3.2), 1u);
  EXPECT_EQ(observed(3.2, 3.2), 0u);
  EXPECT_EQ(observed(9.0, 3.2), 0u);
  EXPECT_EQ(observed(1.6, 1.6), 0u);
  EXPECT_EQ(observed(0.8, 1.6), 2u);
}

TEST(Stacking, AClassPartsFromTheOthersWhenItWasSeenOften) {
  ErrorStatistics error_statistics = nothing_fitted();
  const Eigen::VectorXd own = coefficients<kStackedFeatures>({{1, 0.8}});
  add_examples(error_statistics, kFittedClass, 3000, kTruth);
  add_examples(error_statistics, kOtherClass, 3, own);
  EXPECT_GT(distance(Stacking(error_statistics, {}), kOtherClass, own),
            0.1);  // three examples against the experience with others
  add_examples(error_statistics, kOtherClass, 30000, own);
  EXPECT_LT(distance(Stacking(error_statistics, {}), kOtherClass, own), 0.01);
}

TEST(Stacking, PeopleWhoStandPartEarlierFromThoseWhoWalk) {
  constexpr int standing = 0;
  ErrorStatistics error_statistics = nothing_fitted();
  const Eigen::VectorXd own = coefficients<kStackedFeatures>({{1, 0.8}});
  add_examples(error_statistics, kFittedClass, 3000, kTruth);
  add_examples(error_statistics, standing, 300, own);
  EXPECT_LT(distance(Stacking(error_statistics, {}), standing, own), 0.03);
}

}  // namespace
}  // namespace sila
