// What stacking leaves over at a place is learnt, and added to paths.
#include "refine/path_correction.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace sila {
namespace {

constexpr double kInterval_s = 0.2;
constexpr int kSteps = 25;

ErrorStatistics nothing() {
  return zero_error_statistics(kSteps, kInterval_s, 3.2);
}

CurbFrame turned_frame(double angle) {
  const Vector2 axis(std::cos(angle), std::sin(angle));
  return make_curb_frame({7.0, -2.0}, axis, {-axis.y(), axis.x()}, 3.0);
}

CurbTrajectory seen_at(const CurbFrame& frame, const Vector2& curb_m) {
  CurbTrajectory observed;
  observed.frame = frame;
  observed.times_s = {0.0, kInterval_s};
  observed.positions = {curb_m - Vector2(kInterval_s, 0.0), curb_m};
  observed.velocities = {Vector2::UnitX(), Vector2::UnitX()};
  return observed;
}

/// People walk along the first curb; within 3 m of the corner they drift to the left by 0.3 m/s on average, elsewhere
/// they do not. Batches of 50 windows.
void learn(ErrorStatistics& past, const CurbFrame& frame, int batches, unsigned seed, double drift_mps = 0.3) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x_m(-20.0, 20.0), y_m(-1.0, 1.0);
  std::normal_distribution<double> noise_mps(0.0, 0.1);
  const Matrix2 to_world = world_from_curb(frame);
  for (int batch = 0; batch < batches; ++batch) {
    const PathCorrection known(past);
    for (int i = 0; i < 50; ++i) {
      const Vector2 position_m(x_m(random), y_m(random));
      const Vector2 error_mps(noise_mps(random),
                              noise_mps(random) + (std::abs(position_m.x()) < 3.0 ? drift_mps : 0.0));
      known.add_window(past, seen_at(frame, position_m), std::vector<Vector2>(kSteps, to_world * error_mps),
                       to_world * Vector2::UnitX());
    }
  }
}

Vector2 correction_at(const ErrorStatistics& moments, const CurbFrame& frame, const Vector2& curb_m) {
  const Vector2 stacked_mps = world_from_curb(frame) * Vector2::UnitX();
  return PathCorrection(moments).correction(seen_at(frame, curb_m), stacked_mps, kSteps * kInterval_s).at(2.0);
}

TEST(PathCorrection, IsZeroBeforeAnythingWasLearnt) {
  EXPECT_EQ(correction_at({}, turned_frame(0.0), {1.0, 0.0}), Vector2::Zero());
  EXPECT_EQ(correction_at(nothing(), turned_frame(0.0), {1.0, 0.0}), Vector2::Zero());
  ErrorStatistics one_batch = nothing();  // no correction was known before it
  learn(one_batch, turned_frame(0.0), 1, 1);
  EXPECT_EQ(correction_at(one_batch, turned_frame(0.0), {1.0, 0.0}), Vector2::Zero());
  ErrorStatistics share_alone = nothing();  // as a file may say
  learn(share_alone, turned_frame(0.0), 4, 1);
  share_alone.correction = nothing().correction;
  EXPECT_EQ(correction_at(share_alone, turned_frame(0.0), {1.0, 0.0}), Vector2::Zero());
}

TEST(PathCorrection, IsWhatStackingLeavesOverThere) {
  const CurbFrame frame = turned_frame(0.0);
  ErrorStatistics past = nothing();
  learn(past, frame, 40, 1);
  const Vector2 here = correction_at(past, frame, {-1.0, 0.0}), elsewhere = correction_at(past, frame, {12.0, 0.0});
  EXPECT_NEAR(here.y(), 0.3, 0.08);
  EXPECT_NEAR(here.x(), 0.0, 0.05);
  EXPECT_NEAR(elsewhere.norm(), 0.0, 0.05);
}

TEST(PathCorrection, IsNotAddedWhereItDidNotHelp) {
  const CurbFrame frame = turned_frame(0.0);
  ErrorStatistics past = nothing();
  learn(past, frame, 10, 1, 0.0);
  EXPECT_LT(correction_at(past, frame, {-1.0, 0.0}).norm(), 0.01);
}

TEST(PathCorrection, TurnsWithTheCorner) {
  for (const double angle : {0.7, std::numbers::pi}) {
    ErrorStatistics straight = nothing(), turned = nothing();
    learn(straight, turned_frame(0.0), 4, 2);
    learn(turned, turned_frame(angle), 4, 2);
    const Vector2 expected =
        world_from_curb(turned_frame(angle)) * correction_at(straight, turned_frame(0.0), {1.0, 0.5});
    EXPECT_GT(expected.norm(), 0.01);
    EXPECT_LT((correction_at(turned, turned_frame(angle), {1.0, 0.5}) - expected).norm(), 1e-9);
  }
}

TEST(PathCorrection, LearnsFromLessStepsThanKnots) {
  const std::vector<Vector2> errors(2, Vector2(0.0, 0.1));
  ErrorStatistics past = zero_error_statistics(2, kInterval_s, 3.2);
  PathCorrection(past).add_window(past, seen_at(turned_frame(0.0), {1.0, 0.0}), errors, Vector2::UnitX());
  const Eigen::RowVectorXd at_each_knot = past.correction.products.row(0) / past.correction.products(0, 1);
  for (int k = 0; k < kCorrectionKnots; ++k) EXPECT_NEAR(at_each_knot(2 * k + 1), 1.0, 1e-12);
}

TEST(PathCorrection, KeepsNoPosition) {
  const CurbFrame frame = turned_frame(0.0);
  const std::vector<Vector2> errors(kSteps, Vector2(0.0, 0.1));
  const auto features_of = [&](const Vector2& position_m) {
    ErrorStatistics past = nothing();
    PathCorrection(past).add_window(past, seen_at(frame, position_m), errors, Vector2::UnitX());
    return past.correction.features;
  };
  EXPECT_EQ(features_of({1.03, 0.1}), features_of({0.97, -0.2}));
  EXPECT_NE(features_of({1.03, 0.1}), features_of({2.0, 0.1}));
}

}  // namespace
}  // namespace sila
