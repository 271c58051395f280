#include "refine/error_density.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "model/parts.hpp"

namespace sila {
namespace {

constexpr int kSteps = 3;
constexpr double kInterval_s = 0.4;

DensityMoments no_errors() {
  return zero_error_statistics(kSteps, kInterval_s, 3.2).density[kWalking];
}

ScaleFeatures features_at(double change_mps) {
  PastVelocities past_mps = Vector2(1.2, 0.0).replicate<1, 4>();
  past_mps(1, 0) = change_mps;
  return scale_features(past_mps, {1.2, 0.0}, 5.0);
}

/// Errors of windows whose spread grows with the change of velocity; one in five is from a Gaussian 4 times as wide.
struct Windows {
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;

  double change_mps() { return 0.02 + 0.4 * uniform(random); }
  std::vector<Vector2> errors_m(double change_mps) {
    const double spread = (0.05 + change_mps) * (uniform(random) < 0.2 ? 4.0 : 1.0);
    std::vector<Vector2> errors;
    for (int step = 0; step < kSteps; ++step)
      errors.push_back(spread * (step + 1) * Vector2(normal(random), 0.5 * normal(random)));
    return errors;
  }
};

/// Density of an error [1/m^2].
double density_of(const ErrorDensity& density, std::size_t step, const ErrorScale& scale, const Vector2& error_m) {
  double sum = 0.0;
  for (std::size_t c = 0; c < kMixtureComponents; ++c) {
    const Vector2 variances = density.variances_m2(c, step, scale);
    sum += scale.weights[c] * std::exp(-0.5 * (error_m.array().square() / variances.array()).sum()) /
           std::sqrt(variances.prod());
  }
  return sum / (2.0 * 3.14159265358979);
}

ErrorDensity fitted(int windows) {
  Windows source;
  DensityMoments moments = no_errors();
  for (int i = 0; i < windows; ++i) {
    const ErrorDensity now(moments, kSteps, kInterval_s);
    const double change_mps = source.change_mps();
    now.add_errors(moments, features_at(change_mps), source.errors_m(change_mps));
  }
  return ErrorDensity(moments, kSteps, kInterval_s);
}

/// Mean log density of fresh errors of the last step.
double mean_log_density(const ErrorDensity& density) {
  Windows fresh;
  fresh.random.seed(6);
  double sum = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double change_mps = fresh.change_mps();
    const Vector2 error_m = fresh.errors_m(change_mps).back();
    sum += std::log(density_of(density, kSteps - 1, density.scale(features_at(change_mps)), error_m)) / 2000.0;
  }
  return sum;
}

TEST(ErrorDensity, IntegratesToOne) {
  const ErrorDensity density = fitted(300);
  const ErrorScale scale = density.scale(features_at(0.1));
  const double cell_m = 0.05;
  double sum = 0.0;
  for (double x = -15.0; x < 15.0; x += cell_m) {
    for (double y = -15.0; y < 15.0; y += cell_m) sum += cell_m * cell_m * density_of(density, 1, scale, {x, y});
  }
  EXPECT_NEAR(sum, 1.0, 1e-3);  // cells of 5 cm, and what lies beyond 15 m
}

TEST(ErrorDensity, LearnsThatErrorsGrowWithTheChangeOfVelocity) {
  const ErrorDensity density = fitted(1500);
  const Vector2 small = density.scale(features_at(0.05)).factors, large = density.scale(features_at(0.4)).factors;
  EXPECT_GT(large.x() / small.x(), 4.0);  // the true ratio of variances is 20
  EXPECT_GT(large.y() / small.y(), 4.0);
}

TEST(ErrorDensity, GrowsWithThePowerOfTheSpeedOfPeopleFasterThanThoseLearnt) {
  const auto features = [](double speed_mps) {
    return scale_features(Vector2(speed_mps, 0.0).replicate<1, 4>(), {speed_mps, 0.0}, 5.0);
  };
  const auto factor = [&](const ErrorDensity& density, double mps) { return density.scale(features(mps)).factors.x(); };
  for (const double median_mps : {1.2, 4.8}) {
    DensityMoments moments = no_errors();
    std::mt19937 random(8);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 1000; ++i) {  // the faster a person, the smaller the errors
      const double relative = std::exp(0.1 * normal(random));
      const Vector2 error_m = Vector2::Constant(0.1 / std::pow(relative, 4.0) * normal(random));
      ErrorDensity(moments, kSteps, kInterval_s)
          .add_errors(moments, features(relative * median_mps), std::vector<Vector2>(kSteps, error_m));
    }
    const ErrorDensity walking(moments, kSteps, kInterval_s), standing(moments, kSteps, kInterval_s, kStanding);
    // Speeds that were learnt, and faster ones. The logarithm is that of the speed plus 0.1.
    EXPECT_LT(factor(walking, 1.08 * median_mps), 0.95 * factor(walking, 0.92 * median_mps));
    EXPECT_NEAR(factor(walking, 12.9) / factor(walking, 6.4), 8.0, 1e-9);
    EXPECT_LE(factor(standing, 12.9), factor(standing, 6.4));
  }
}

TEST(ErrorDensity, LearnsInWhichWindowsErrorsAreVerySmallOrLarge) {
  DensityMoments moments = no_errors();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3000; ++i) {
    // The logarithm of the spread has the same mean in both, so that a scale cannot tell them apart.
    const bool curved = i % 2 == 0;
    const double spread_m = curved ? (i % 4 == 0 ? 0.03 : 0.9) : 0.164;
    std::vector<Vector2> errors_m(kSteps);
    for (Vector2& error_m : errors_m) error_m = spread_m * Vector2(normal(random), normal(random));
    ErrorDensity(moments, kSteps, kInterval_s).add_errors(moments, features_at(curved ? 0.4 : 0.02), errors_m);
  }
  const ErrorDensity density(moments, kSteps, kInterval_s);
  const ErrorScale curved = density.scale(features_at(0.4)), straight = density.scale(features_at(0.02));
  const auto times = [&](double error_m) {
    return density_of(density, 2, curved, {error_m, 0.0}) / density_of(density, 2, straight, {error_m, 0.0});
  };
  EXPECT_GT(times(0.0), 2.0);
  EXPECT_LT(times(0.2), 0.5);
  EXPECT_GT(times(1.2), 3.0);
}

TEST(ErrorDensity, BeatsTheBestSingleGaussian) {
  Windows source;
  Vector2 squares = Vector2::Zero();
  for (int i = 0; i < 5000; ++i) squares += source.errors_m(source.change_mps()).back().array().square().matrix();
  const Vector2 variances = squares / 5000.0;
  const double gaussian = -1.0 - std::log(2.0 * 3.14159265358979) - 0.5 * std::log(variances.prod());
  EXPECT_GT(mean_log_density(fitted(1500)), gaussian + 0.3);
}

TEST(ErrorDensity, AddsMomentsExactly) {
  Windows source;
  const ErrorDensity density(no_errors(), kSteps, kInterval_s);
  DensityMoments first = no_errors(), second = no_errors(), both = no_errors();
  for (int i = 0; i < 20; ++i) {
    const double change_mps = source.change_mps();
    const auto errors_m = source.errors_m(change_mps);
    density.add_errors(i < 10 ? first : second, features_at(change_mps), errors_m);
    density.add_errors(both, features_at(change_mps), errors_m);
  }
  add_sums(first, second);
  EXPECT_LT((first.scale.features - both.scale.features).norm(), 1e-10);
  EXPECT_LT((first.scale.products - both.scale.products).norm(), 1e-10);
  for (std::size_t c = 0; c < both.components.size(); ++c)
    EXPECT_NEAR(first.components[c].along, both.components[c].along, 1e-9);
}

TEST(ErrorDensity, BeginsNarrowerForPeopleWhoStand) {
  const ErrorDensity walking(no_errors(), kSteps, kInterval_s, kWalking),
      standing(no_errors(), kSteps, kInterval_s, kStanding);
  const ErrorScale scale = walking.scale(features_at(0.1));
  const ErrorScale still = standing.scale(features_at(0.1));
  const Vector2 none = Vector2::Zero(), far(2.0, 0.0);
  EXPECT_GT(density_of(standing, 0, still, none), 2.0 * density_of(walking, 0, scale, none));
  EXPECT_GT(density_of(standing, 0, still, far), density_of(walking, 0, scale, far));  // who starts to walk is far off
}

TEST(ErrorDensity, GrowsBeyondTheFittedStepsAndNeverVanishes) {
  const ErrorDensity density = fitted(100);
  const Vector2 last = density.variances_m2(0, kSteps - 1, {});
  EXPECT_LT((density.variances_m2(0, 2 * kSteps - 1, {}) - 4.0 * last).norm(), 1e-12);
  EXPECT_GE(density.variances_m2(0, 0, {{1e-12, 1e-12}, {}}).minCoeff(), 1e-6);
}

/// Statistics of one step from `windows` windows of each motion state, all of the first component.
ErrorStatistics seen(double windows, double along_m2) {
  ErrorStatistics statistics = zero_error_statistics(1, 0.2, 3.2);
  for (const std::size_t state : {kWalking, kStanding}) {
    statistics.density[state].scale.weight = windows;
    statistics.density[state].components[0] = {windows, windows * along_m2, windows * along_m2};
  }
  statistics.scores[0][0] = windows;
  return statistics;
}

TEST(ErrorStatistics, RecentWindowsCountMoreInDensitiesOfWalkersAndScores) {
  const ErrorStatistics sum = add_error_statistics(seen(850.0, 4.0), seen(1000.0, 1.0), 1e12);
  // ((150 + 850) / (150 + 850 + 1000))^2 of the past.
  EXPECT_NEAR(sum.density[kWalking].components[0].weight, 850.0 / 4.0 + 1000.0, 1e-5);
  EXPECT_NEAR(sum.density[kWalking].components[0].along, 850.0 + 1000.0, 1e-5);
  EXPECT_NEAR(sum.density[kWalking].scale.weight, 1850.0, 1e-5);
  EXPECT_NEAR(sum.density[kStanding].components[0].weight, 1850.0, 1e-5);
  EXPECT_NEAR(sum.scores[0][0], 850.0 * (1850.0 * 1850.0) / (3850.0 * 3850.0) + 1000.0, 1e-5);  // of both states
}

TEST(ErrorStatistics, OfAnInfiniteMemoryAddExactly) {
  const double infinite = std::numeric_limits<double>::infinity();
  const ErrorStatistics sum = add_error_statistics(seen(850.0, 4.0), seen(1000.0, 1.0), infinite);
  EXPECT_EQ(sum.density[kWalking].components[0].weight, 1850.0);
  EXPECT_EQ(sum.density[kWalking].components[0].along, 4400.0);
  EXPECT_EQ(sum.scores[0][0], 1850.0);
}

}  // namespace
}  // namespace sila
