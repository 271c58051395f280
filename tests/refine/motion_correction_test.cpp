// What stacking leaves over by how people and their companions walk is learnt, and added to paths.
#include "refine/motion_correction.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sila {
namespace {

constexpr double kInterval_s = 0.2, kHorizon_s = 5.0;
constexpr int kSteps = 25;

/// A person walks into a direction; `companions_mps` in the heading frame.
MotionInput walking(const Vector2& heading, const Vector2& companions_mps, double speed_mps = 1.2) {
  const Vector2 velocity = speed_mps * heading;
  return change_input(velocity.replicate<1, 4>(), velocity, axes_along(heading) * companions_mps);
}

/// People walk into any direction; the error of stacked velocities is half of the companions' relative velocity, and
/// noise.
ErrorStatistics learnt(int batches, double share = 0.5, bool left_only = false) {
  std::mt19937 random(1);
  std::normal_distribution<double> companion_mps(0.0, 0.3), noise_mps(0.0, 0.1);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  ErrorStatistics past = zero_error_statistics(kSteps, kInterval_s, 3.2);
  for (int batch = 0; batch < batches; ++batch) {
    const MotionCorrection known(past);
    for (int i = 0; i < 50; ++i) {
      const double turn = angle(random);
      const Vector2 heading(std::cos(turn), std::sin(turn));
      Vector2 companions(companion_mps(random), companion_mps(random));
      if (left_only) companions.y() = std::abs(companions.y());
      const Vector2 error = share * axes_along(heading) * companions + Vector2(noise_mps(random), noise_mps(random));
      known.add_window(past, walking(heading, companions), std::vector<Vector2>(kSteps, error));
    }
  }
  return past;
}

Vector2 correction_at(const ErrorStatistics& past, const Vector2& heading, const Vector2& companions_mps) {
  return MotionCorrection(past).correction(walking(heading, companions_mps), kHorizon_s).at(2.0);
}

TEST(MotionCorrection, IsZeroBeforeAnythingWasLearnt) {
  EXPECT_EQ(correction_at({}, Vector2::UnitX(), {0.2, 0.0}), Vector2::Zero());
  EXPECT_EQ(correction_at(learnt(1), Vector2::UnitX(), {0.2, 0.0}), Vector2::Zero());
  ErrorStatistics share_alone = learnt(4);  // as a file may say
  share_alone.motion = zero_error_statistics(kSteps, kInterval_s, 3.2).motion;
  EXPECT_EQ(correction_at(share_alone, Vector2::UnitX(), {0.2, 0.0}), Vector2::Zero());
}

TEST(MotionCorrection, FollowsCompanionsAsFarAsItHelped) {
  const ErrorStatistics past = learnt(40);
  const Vector2 to_left = correction_at(past, Vector2::UnitX(), {0.0, 0.3});
  const Vector2 ahead = correction_at(past, Vector2::UnitX(), {0.3, 0.0});
  EXPECT_NEAR(to_left.y(), 0.15, 0.04);
  EXPECT_NEAR(to_left.x(), 0.0, 0.02);
  EXPECT_NEAR(ahead.x(), 0.15, 0.04);
  EXPECT_EQ(ahead.y(), 0.0);  // straight ahead, a left and a right turn are alike
  EXPECT_NEAR(correction_at(past, Vector2::UnitX(), {0.0, 0.0}).norm(), 0.0, 0.02);
  EXPECT_LT(correction_at(learnt(10, 0.0), Vector2::UnitX(), {0.0, 0.3}).norm(), 0.01);
}

TEST(MotionCorrection, TurnsWithTheHeading) {
  const ErrorStatistics past = learnt(5);
  const Vector2 ahead = correction_at(past, Vector2::UnitX(), {0.1, 0.3});
  const Vector2 up = correction_at(past, Vector2::UnitY(), {0.1, 0.3});
  EXPECT_GT(ahead.norm(), 0.01);
  EXPECT_NEAR((up - Vector2(-ahead.y(), ahead.x())).norm(), 0.0, 1e-12);
}

TEST(MotionCorrection, LearnsOfALeftTurnWhatHoldsForARightOne) {
  const ErrorStatistics past = learnt(20, 0.5, true);
  const Vector2 to_left = correction_at(past, Vector2::UnitX(), {0.1, 0.3});
  const Vector2 to_right = correction_at(past, Vector2::UnitX(), {0.1, -0.3});
  EXPECT_GT(to_left.y(), 0.05);
  EXPECT_NEAR(to_right.y(), -to_left.y(), 1e-12);
  EXPECT_NEAR(to_right.x(), to_left.x(), 1e-12);
}

TEST(MotionCorrection, HoldsAlsoFarFromTheSpeedsThatItLearnt) {
  const MotionCorrection known(learnt(40));  // at 1.2 m/s
  for (const double speed_mps : {2.4, 2.8, 3.2, 3.6, 4.0}) {
    const MotionInput faster = walking(Vector2::UnitX(), {0.0, 0.3}, speed_mps);
    EXPECT_NEAR(known.correction(faster, kHorizon_s).at(2.0).y(), 0.15, 0.03) << speed_mps;
  }
}

TEST(MotionCorrection, OfTwoModelsIsThatOfTheirSum) {
  const ErrorStatistics more = learnt(6), sum = add_error_statistics(learnt(4), more);
  EXPECT_EQ(sum.motion[0].weight, learnt(4).motion[0].weight + more.motion[0].weight);
  EXPECT_TRUE(sum.motion[1].features.isApprox(learnt(4).motion[1].features + more.motion[1].features));
}

}  // namespace
}  // namespace sila
