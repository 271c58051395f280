#include "sila/model/outlook.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sila/core/sampling.hpp"
#include "sila/gp/posterior.hpp"
#include "sila/model/gait.hpp"
#include "sila/model/place.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

Conventions conventions_until(double horizon_s, int knots) {
  Conventions conventions;
  conventions.outlook_horizon_s = horizon_s;
  conventions.outlook_knots = knots;
  return conventions;
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

TEST(Outlook, ExampleOfSteadyWalkingPartsByNothing) {
  const Seen seen = seen_on({{10, 1}, {-10, 1}});
  const auto example = outlook_example(seen.observed, seen.future_m, conventions_until(5.0, 4), 0.75);
  ASSERT_TRUE(example);
  EXPECT_EQ(example->partings.size(), 8);
  EXPECT_LT(example->partings.norm(), 1e-6);
  EXPECT_NEAR(example->state(2), -1.25 / 2.5, 1e-6);  // widths per second
}

TEST(Outlook, ExampleOfATurnPartsByTheDifferenceOfMeanVelocities) {
  const Seen seen = seen_on({{5, 1}, {0, 1}, {0, 20}});  // turns right at t0
  const auto example = outlook_example(seen.observed, seen.future_m, conventions_until(4.0, 2), 1.0);
  ASSERT_TRUE(example);
  // The mean velocity until the second knot is (0, 1.25) m/s, constant velocity (-1.25, 0).
  EXPECT_NEAR(example->partings(2), 1.25 / 2.5, 0.02);
  EXPECT_NEAR(example->partings(3), 1.25 / 2.5, 0.02);
  EXPECT_NEAR(example->gait_partings(2), -1.25, 0.05);  // less far ahead
  EXPECT_NEAR(example->gait_partings(3), -1.25, 0.05);  // to the right
}

TEST(Outlook, ExampleNeedsTheShareOfItsFuture) {
  const Seen seen = seen_on({{10, 1}, {-10, 1}});
  const std::span<const Vector2> future(seen.future_m);
  EXPECT_TRUE(outlook_example(seen.observed, future.first(19), conventions_until(5.0, 4), 0.75));
  EXPECT_FALSE(outlook_example(seen.observed, future.first(18), conventions_until(5.0, 4), 0.75));
  EXPECT_FALSE(outlook_example(seen.observed, {}, conventions_until(5.0, 4), 0.01));
}

TEST(Gait, DependsNeitherOnThePlaceNorOnTheDirection) {
  const GaitState east = gait_state(seen_on({{0, 0}, {20, 0}}).observed);
  const GaitState elsewhere = gait_state(seen_on({{-7, 30}, {-7, -30}}).observed);
  EXPECT_LT((east - elsewhere).norm(), 1e-9);
}

TEST(Gait, ForeseesTheMirrorImageOfWhatItSaw) {
  const Seen right = seen_on({{5, 1}, {0.5, 1}, {0.5, 20}});
  const auto example = outlook_example(right.observed, right.future_m, conventions_until(5.0, 4), 1.0);
  ASSERT_TRUE(example);
  const SparseGp gait = learn_gait({}, gait_samples({&*example}), {});
  const Seen left = seen_on({{5, 1}, {0.5, 1}, {0.5, -18}});
  const Posterior posterior(gait);
  const Eigen::VectorXd saw = posterior.predict(Eigen::VectorXd(gait_state(right.observed))).mean;
  const Eigen::VectorXd mirrored = posterior.predict(Eigen::VectorXd(gait_state(left.observed))).mean;
  EXPECT_GT(std::abs(saw(7)), 0.05);
  EXPECT_NEAR(saw(7), -mirrored(7), 1e-6);
  EXPECT_NEAR(saw(6), mirrored(6), 1e-6);
}

TEST(Gait, AbsorbsEveryExampleOnceItsPseudoInputsAreFull) {
  OutlookConfig config;
  config.gait_pseudo_inputs = 3;
  SparseGp gait;
  for (int i = 0; i < 4; ++i) {
    const Seen seen = seen_on({{5, 1}, {0.2 * i, 1}, {0.2 * i, 20}});
    const auto example = outlook_example(seen.observed, seen.future_m, conventions_until(5.0, 4), 1.0);
    ASSERT_TRUE(example);
    gait = learn_gait(gait, gait_samples({&*example}), config);
  }
  EXPECT_EQ(gait.points, 8.0);  // and their mirror images
  EXPECT_LE(gait.pseudo_inputs.cols(), 3);
  EXPECT_NO_THROW(validate(gait));
}

TEST(Gait, CountsElsewhereAsManyExamplesAsIsTrusted) {
  const Seen seen = seen_on({{5, 1}, {0.5, 1}, {0.5, 20}});
  const auto example = outlook_example(seen.observed, seen.future_m, conventions_until(5.0, 4), 1.0);
  ASSERT_TRUE(example);
  const std::vector<const OutlookExample*> often(50, &*example), twice(2, &*example);
  const SparseGp gait = learn_gait({}, gait_samples(often), {}), few = learn_gait({}, gait_samples(twice), {});
  const SparseGp elsewhere = gait_elsewhere(gait, 4.0);
  EXPECT_EQ(elsewhere.points, 4.0);
  const Eigen::VectorXd here(gait_state(seen.observed));
  const double said = Posterior(elsewhere).predict(here).mean(0);
  EXPECT_NEAR(said, Posterior(few).predict(here).mean(0), 1e-9);
  EXPECT_LT(std::abs(said), 0.95 * std::abs(Posterior(gait).predict(here).mean(0)));
  EXPECT_EQ(Posterior(gait_elsewhere(gait, 0.0)).predict(here).mean(0), 0.0);
  EXPECT_EQ(gait_elsewhere(few, 25.0).points, few.points);
}

TEST(Place, IsKnownByItsCornerAndCurbs) {
  const CurbFrame corner = testing::square_frame();
  CurbFrame near = corner, turned = corner;
  near.origin_m = {0.6, 0.6};
  turned.axis_1 = {0, 1}, turned.axis_2 = {-1, 0};
  EXPECT_TRUE(same_place(corner, near));
  EXPECT_FALSE(same_place(corner, turned));
  EXPECT_EQ(with_places({corner}, {near, turned, turned}).size(), 2u);
}

}  // namespace
}  // namespace sila
