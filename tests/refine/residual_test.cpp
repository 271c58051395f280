#include "refine/residual.hpp"

#include <gtest/gtest.h>

#include "sila/core/sampling.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

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
  const auto example = residual_sample(seen.observed, seen.future_m, 0.2, {5.0, 4});
  ASSERT_TRUE(example);
  EXPECT_EQ(example->residuals.size(), 8);
  EXPECT_LT(example->residuals.norm(), 1e-6);
  EXPECT_NEAR(example->state(2), -1.25, 1e-6);
}

TEST(Residual, ExampleOfATurnPartsByTheDifferenceOfMeanVelocities) {
  const Seen seen = seen_on({{5, 1}, {0, 1}, {0, 20}});  // turns right at t0
  const auto example = residual_sample(seen.observed, seen.future_m, 0.2, {4.0, 2});
  ASSERT_TRUE(example);
  // The mean velocity until the second knot is (0, 1.25) m/s, constant velocity (-1.25, 0).
  EXPECT_NEAR(example->residuals(2), 1.25, 0.05);
  EXPECT_NEAR(example->residuals(3), 1.25, 0.05);
}

TEST(Residual, ExampleNeedsTheShareOfItsFuture) {
  const Seen seen = seen_on({{10, 1}, {-10, 1}});
  const std::span<const Vector2> future(seen.future_m);
  EXPECT_TRUE(residual_sample(seen.observed, future.first(19), 0.2, {5.0, 4}));
  EXPECT_FALSE(residual_sample(seen.observed, future.first(18), 0.2, {5.0, 4}));
  EXPECT_FALSE(residual_sample(seen.observed, {}, 0.2, {5.0, 4}));
}

}  // namespace
}  // namespace sila
