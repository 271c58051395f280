// When people who stand start, and people who walk stop.
#include "refine/motion_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "model/parts.hpp"

namespace sila {
namespace {

constexpr double kInterval_s = 0.2;

RegressionMoments no_moments() {
  return {0.0, Eigen::MatrixXd::Zero(kHazardFeatures, kHazardFeatures), Eigen::MatrixXd::Zero(kHazardFeatures, 1)};
}

/// Of a person whose velocities are all `speed_mps`.
HazardFeatures steady(double speed_mps, double still_s = 3.0, const Vector2& position_m = Vector2::Zero()) {
  const Vector2 v(speed_mps, 0.0);
  return hazard_features(v.replicate<1, 4>(), v, speed_mps, still_s, position_m);
}

std::vector<double> probabilities(const MotionChange& change, const HazardFeatures& features, std::size_t steps = 24) {
  std::vector<double> result(steps);
  change.probabilities(features, result);
  return result;
}

/// Positions along x, `kInterval_s` apart.
std::vector<Vector2> walk(double from_m, double speed_mps, std::size_t steps) {
  std::vector<Vector2> path_m;
  for (std::size_t j = 0; j < steps; ++j)
    path_m.emplace_back(from_m + speed_mps * kInterval_s * static_cast<double>(j + 1), 0.0);
  return path_m;
}

TEST(MotionChange, APersonWhoStandsStartsHalfAMetreAway) {
  const std::vector<Vector2> past_m(8, Vector2::Zero());
  EXPECT_EQ(change_step(kStanding, past_m, walk(0.0, 1.0, 10), kInterval_s), 2);  // 0.6 m
  EXPECT_EQ(change_step(kStanding, past_m, walk(0.0, 0.1, 24), kInterval_s), std::nullopt);
}

TEST(MotionChange, APersonWhoWalksStopsWhenTheLastWindowWasSlow) {
  const std::vector<Vector2> past_m = walk(-2.0, 1.25, 8);  // ends at 0
  std::vector<Vector2> future_m = walk(0.0, 1.25, 4);
  EXPECT_EQ(change_step(kWalking, past_m, future_m, kInterval_s), std::nullopt);
  future_m.insert(future_m.end(), 6, future_m.back());  // after step 3 no motion: step 7 is the first 0.8 s without
  EXPECT_EQ(change_step(kWalking, past_m, future_m, kInterval_s), 7);
  // Nothing is said while less than 0.8 s are known.
  EXPECT_EQ(change_step(kWalking, std::vector<Vector2>(1, Vector2::Zero()), std::vector<Vector2>(3, Vector2::Zero()),
                        kInterval_s),
            std::nullopt);
}

TEST(MotionChange, ProbabilitiesRiseWithTimeAndStayInRange) {
  for (const std::size_t state : {kWalking, kStanding}) {
    const MotionChange change(no_moments(), state, kInterval_s);
    for (const double speed_mps : {0.0, 0.1, 1.0, 3.0, 1e6}) {
      double before = 0.0;
      for (const double p : probabilities(change, steady(speed_mps))) {
        EXPECT_GE(p, before);
        EXPECT_LE(p, 1.0);
        before = p;
      }
    }
  }
}

TEST(MotionChange, BeforeAnythingWasSeenSpeedDecides) {
  const MotionChange start(no_moments(), kStanding, kInterval_s), stop(no_moments(), kWalking, kInterval_s);
  EXPECT_GT(probabilities(start, steady(0.25)).back(), 2.0 * probabilities(start, steady(0.02, 60.0)).back());
  EXPECT_GT(probabilities(stop, steady(0.4)).back(), 2.0 * probabilities(stop, steady(1.4)).back());
}

TEST(MotionChange, TheIntervalOfTheStepsDoesNotMatterMuch) {
  const double fine = probabilities(MotionChange(no_moments(), kStanding, 0.1), steady(0.1), 48).back();
  const double coarse = probabilities(MotionChange(no_moments(), kStanding, 0.4), steady(0.1), 12).back();
  EXPECT_NEAR(fine, coarse, 0.05);
}

/// Moments of people with the same hazard in each step, learnt in episodes of 50.
RegressionMoments learnt(double hazard, int episodes, std::mt19937& random) {
  RegressionMoments moments = no_moments();
  std::geometric_distribution<std::size_t> step(hazard);
  std::uniform_real_distribution<double> speed(0.0, 0.3), still(0.0, 20.0);
  for (int e = 0; e < episodes; ++e) {
    std::vector<ChangeWindow> windows;
    for (int i = 0; i < 50; ++i) {
      const std::size_t change = step(random);
      windows.push_back({steady(speed(random), still(random)), change < 24 ? std::optional(change) : std::nullopt, 24});
    }
    add_sums(moments, MotionChange(moments, kStanding, kInterval_s).moments_of(windows));
  }
  return moments;
}

TEST(MotionChange, LearnsAHazardThatDependsOnNothing) {
  std::mt19937 random(1);
  const MotionChange change(learnt(0.02, 100, random), kStanding, kInterval_s);
  for (const double speed_mps : {0.05, 0.15, 0.25}) {
    const std::vector<double> p = probabilities(change, steady(speed_mps, 5.0));
    EXPECT_NEAR(p[4], 1.0 - std::pow(0.98, 5), 0.04);
    EXPECT_NEAR(p[23], 1.0 - std::pow(0.98, 24), 0.08);
  }
}

TEST(MotionChange, OneEpisodeCorrectsALevelThatIsFarOff) {
  std::mt19937 random(1);
  const double before = probabilities(MotionChange(no_moments(), kStanding, kInterval_s), steady(0.2, 1.0)).back();
  const MotionChange change(learnt(0.002, 1, random), kStanding, kInterval_s);
  EXPECT_GT(before, 0.8);
  EXPECT_LT(probabilities(change, steady(0.2, 1.0)).back(), 0.4);
}

TEST(MotionChange, LearnsWhereAtASitePeopleStart) {
  std::mt19937 random(1);
  const Vector2 curb_m(1.0, 4.0), wall_m(8.0, -3.0);
  std::geometric_distribution<std::size_t> at_curb(0.05), at_wall(0.005);
  RegressionMoments moments = no_moments();
  for (int episode = 0; episode < 40; ++episode) {
    std::vector<ChangeWindow> windows;
    for (int i = 0; i < 20; ++i) {
      const bool curb = i % 2 == 0;
      const std::size_t step = curb ? at_curb(random) : at_wall(random);
      windows.push_back(
          {steady(0.05, 3.0, curb ? curb_m : wall_m), step < 24 ? std::optional(step) : std::nullopt, 24});
    }
    add_sums(moments, MotionChange(moments, kStanding, kInterval_s).moments_of(windows));
  }
  const auto started = [&](const RegressionMoments& known, const Vector2& position_m) {
    return probabilities(MotionChange(known, kStanding, kInterval_s), steady(0.05, 3.0, position_m)).back();
  };
  EXPECT_NEAR(started(moments, curb_m), 1.0 - std::pow(0.95, 24), 0.1);
  EXPECT_NEAR(started(moments, wall_m), 1.0 - std::pow(0.995, 24), 0.1);
  // Other people of the same sums, without their positions: the place makes no difference.
  ErrorStatistics error_statistics = zero_error_statistics(24, kInterval_s, 3.2);
  error_statistics.changes[kStanding] = moments;
  forget_positions(error_statistics);
  const RegressionMoments& elsewhere = error_statistics.changes[kStanding];
  EXPECT_EQ(started(elsewhere, curb_m), started(elsewhere, wall_m));
  EXPECT_GT(started(elsewhere, curb_m), started(moments, wall_m));
  EXPECT_LT(started(elsewhere, curb_m), started(moments, curb_m));
}

TEST(MotionChange, SumsAreThoseOfEachStepOfAWindow) {
  const MotionChange change(no_moments(), kStanding, kInterval_s);
  const HazardFeatures features = steady(0.1, 3.0, Vector2(1.0, 2.0));
  const ChangeWindow two{features, std::nullopt, 2}, one{features, std::nullopt, 1};
  const RegressionMoments whole = change.moments_of(std::span(&two, 1)), first = change.moments_of(std::span(&one, 1));
  // The features of the place are the same in each step, so their sums share the weights of the constant feature.
  const auto place = features.tail<kHazardPlaceFeatures>();
  for (const RegressionMoments& moments : {whole, first}) {
    EXPECT_TRUE(moments.features.bottomLeftCorner(kHazardPlaceFeatures, 1).isApprox(moments.features(0, 0) * place));
    EXPECT_TRUE(moments.products.bottomRows(kHazardPlaceFeatures).isApprox(moments.products(0, 0) * place));
  }
  EXPECT_GT(whole.features(0, 0), first.features(0, 0));
}

TEST(MotionChange, ATrackThatEndsSaysNothingOfWhatComesAfter) {
  const MotionChange change(no_moments(), kStanding, kInterval_s);
  const ChangeWindow windows[] = {{steady(0.1), std::nullopt, 5}, {steady(0.1), 2, 24}};
  EXPECT_EQ(change.moments_of(std::span(windows, 1)).weight, 5.0);
  EXPECT_EQ(change.moments_of(windows).weight, 8.0);
}

}  // namespace
}  // namespace sila
