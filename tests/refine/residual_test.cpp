#include "refine/residual.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "gp/posterior.hpp"
#include "refine/global_residual.hpp"
#include "sila/core/sampling.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

ModelSettings settings_until(double horizon_s, int knots) {
  ModelSettings settings;
  settings.residual_horizon_s = horizon_s;
  settings.residual_knots = knots;
  return settings;
}

/// 4 s along `way` at 1.25 m/s, and the next 5 s.
struct Seen {
  CurbTrajectory observed;
  std::vector<Vector2> future_m;
};
Seen seen_on(const std::vector<Vector2>& way) {
  const Trajectory track = testing::walk("w", way, 1.25);
  return {observe(track, 40, testing::square_frame(), 3.2, {}), future(track, 40, 25, {})};
}

TEST(Residual, ExampleOfSteadyWalkingPartsByNothing) {
  const Seen seen = seen_on({{10, 1}, {-10, 1}});
  const auto example = residual_sample(seen.observed, seen.future_m, settings_until(5.0, 4), 0.75);
  ASSERT_TRUE(example);
  EXPECT_EQ(example->residuals.size(), 8);
  EXPECT_LT(example->residuals.norm(), 1e-6);
  EXPECT_NEAR(example->state(2), -1.25, 1e-6);
}

TEST(Residual, ExampleOfATurnPartsByTheDifferenceOfMeanVelocities) {
  const Seen seen = seen_on({{5, 1}, {0, 1}, {0, 20}});  // turns right at t0
  const auto example = residual_sample(seen.observed, seen.future_m, settings_until(4.0, 2), 1.0);
  ASSERT_TRUE(example);
  // The mean velocity until the second knot is (0, 1.25) m/s, constant velocity (-1.25, 0).
  EXPECT_NEAR(example->residuals(2), 1.25, 0.05);
  EXPECT_NEAR(example->residuals(3), 1.25, 0.05);
  EXPECT_NEAR(example->global_residuals_mps(2), -1.25, 0.05);  // less far ahead
  EXPECT_NEAR(example->global_residuals_mps(3), -1.25, 0.05);  // to the right
}

TEST(Residual, ExampleNeedsTheShareOfItsFuture) {
  const Seen seen = seen_on({{10, 1}, {-10, 1}});
  const std::span<const Vector2> future(seen.future_m);
  EXPECT_TRUE(residual_sample(seen.observed, future.first(19), settings_until(5.0, 4), 0.75));
  EXPECT_FALSE(residual_sample(seen.observed, future.first(18), settings_until(5.0, 4), 0.75));
  EXPECT_FALSE(residual_sample(seen.observed, {}, settings_until(5.0, 4), 0.01));
}

TEST(GlobalResidual, DependsNeitherOnThePlaceNorOnTheDirection) {
  const GlobalResidualInput east = global_residual_input(seen_on({{0, 0}, {20, 0}}).observed);
  const GlobalResidualInput elsewhere = global_residual_input(seen_on({{-7, 30}, {-7, -30}}).observed);
  EXPECT_LT((east - elsewhere).norm(), 1e-9);
}

TEST(GlobalResidual, ForeseesTheMirrorImageOfWhatItSaw) {
  const Seen right = seen_on({{5, 1}, {0.5, 1}, {0.5, 20}});
  const auto example = residual_sample(right.observed, right.future_m, settings_until(5.0, 4), 1.0);
  ASSERT_TRUE(example);
  const SparseGp global_residual = learn_global_residual({}, global_residual_samples({&*example}), {});
  const Seen left = seen_on({{5, 1}, {0.5, 1}, {0.5, -18}});
  const Posterior posterior(global_residual);
  const Eigen::VectorXd saw = posterior.predict(Eigen::VectorXd(global_residual_input(right.observed))).mean;
  const Eigen::VectorXd mirrored = posterior.predict(Eigen::VectorXd(global_residual_input(left.observed))).mean;
  EXPECT_GT(std::abs(saw(7)), 0.05);
  EXPECT_NEAR(saw(7), -mirrored(7), 1e-6);
  EXPECT_NEAR(saw(6), mirrored(6), 1e-6);
}

TEST(GlobalResidual, AddsEverySampleWhenItsPseudoInputsAreFull) {
  ResidualConfig config;
  config.global_pseudo_inputs = 3;
  SparseGp global_residual;
  for (int i = 0; i < 4; ++i) {
    const Seen seen = seen_on({{5, 1}, {0.2 * i, 1}, {0.2 * i, 20}});
    const auto example = residual_sample(seen.observed, seen.future_m, settings_until(5.0, 4), 1.0);
    ASSERT_TRUE(example);
    global_residual = learn_global_residual(global_residual, global_residual_samples({&*example}), config);
  }
  EXPECT_EQ(global_residual.points, 8.0);  // and their mirror images
  EXPECT_LE(global_residual.pseudo_inputs.cols(), 3);
  EXPECT_NO_THROW(validate(global_residual));
}

TEST(GlobalResidual, CountsElsewhereAsManyExamplesAsIsTrusted) {
  const Seen seen = seen_on({{5, 1}, {0.5, 1}, {0.5, 20}});
  const auto example = residual_sample(seen.observed, seen.future_m, settings_until(5.0, 4), 1.0);
  ASSERT_TRUE(example);
  const std::vector<const ResidualSample*> often(50, &*example), twice(2, &*example);
  const SparseGp global_residual = learn_global_residual({}, global_residual_samples(often), {}),
                 few = learn_global_residual({}, global_residual_samples(twice), {});
  const SparseGp elsewhere = untrained_global_residual(global_residual, 4.0);
  EXPECT_EQ(elsewhere.points, 4.0);
  const Eigen::VectorXd here(global_residual_input(seen.observed));
  const double said = Posterior(elsewhere).predict(here).mean(0);
  EXPECT_NEAR(said, Posterior(few).predict(here).mean(0), 1e-9);
  EXPECT_LT(std::abs(said), 0.95 * std::abs(Posterior(global_residual).predict(here).mean(0)));
  EXPECT_EQ(Posterior(untrained_global_residual(global_residual, 0.0)).predict(here).mean(0), 0.0);
  EXPECT_EQ(untrained_global_residual(few, 25.0).points, few.points);
}

}  // namespace
}  // namespace sila
