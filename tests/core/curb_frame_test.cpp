#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "sila/core/trajectory.hpp"

namespace sila {
namespace {

Vector2 axis(double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  return {std::cos(angle), std::sin(angle)};
}

CurbFrame frame_of(const Vector2& origin, double degrees_1, double degrees_2, double width = 1.0,
                   CurbScaling scaling = CurbScaling::mean_width) {
  return rescaled(make_curb_frame(origin, axis(degrees_1), axis(degrees_2), width), scaling);
}

void expect_near(const Vector2& found, double x, double y, double tolerance = 1e-10) {
  EXPECT_NEAR(found.x(), x, tolerance);
  EXPECT_NEAR(found.y(), y, tolerance);
}

TEST(CurbFrame, GivesTheContravariantCoordinatesOfTheWorkedExamples) {
  expect_near(to_curb(frame_of({1, 1}, 0, 90), {3, 4}), 2.0, 3.0);
  expect_near(to_curb(frame_of({0, 0}, 0, 60), {3, 2}), 1.8452994616, 2.3094010768);
  expect_near(to_curb(frame_of({0, 0}, 0, 120), {3, 2}), 4.1547005384, 2.3094010768);
  expect_near(to_curb(frame_of({1, 1}, 30, 100), {5, 3}), 4.5616271455, -0.2851455747);
  expect_near(to_curb(frame_of({1, 1}, 30, 100, 2.5), {5, 3}), 1.8246508582, -0.1140582299);
}

TEST(CurbFrame, HasARightAngleAndTheBisectorOfTheCurbsInMetres) {
  for (const double between : {30.0, 90.0, 131.0, -70.0}) {
    const CurbFrame curbs = frame_of({1, 1}, 20, 20 + between, 2.5);
    const CurbFrame frame = rescaled(curbs, CurbScaling::metres);
    const double side = between > 0.0 ? 45.0 : -45.0;
    expect_near(frame.axis_1, axis(20 + between / 2 - side).x(), axis(20 + between / 2 - side).y());
    expect_near(frame.axis_2, axis(20 + between / 2 + side).x(), axis(20 + between / 2 + side).y());
    expect_near(rescaled(frame, CurbScaling::metres).axis_1, frame.axis_1.x(), frame.axis_1.y(), 1e-15);
    EXPECT_EQ(rescaled(curbs, CurbScaling::mean_width).axis_1, curbs.axis_1) << "the paper's contravariant coordinates";
  }
}

TEST(CurbFrame, ComesBackToTheWorldAndIsUnmovedByRotatingCornerAndPoint) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE("seed 7, round " + std::to_string(round));
    const double first = 180.0 * uniform(random), between = 90.0 + 60.0 * uniform(random),
                 turn = 180.0 * uniform(random);
    const Vector2 origin(10.0 * uniform(random), 10.0 * uniform(random)),
        point(20.0 * uniform(random), 20.0 * uniform(random));
    const CurbFrame frame = frame_of(origin, first, first + between, 2.0 + uniform(random));
    EXPECT_LT((to_world(frame, to_curb(frame, point)) - point).norm(), 1e-12);
    EXPECT_LT((velocity_to_world(frame, velocity_to_curb(frame, point)) - point).norm(), 1e-12);
    Matrix2 rotation;
    rotation << axis(turn).x(), -axis(turn).y(), axis(turn).y(), axis(turn).x();
    const Vector2 shift(3.0, -4.0);
    CurbFrame turned = frame;
    turned.origin_m = rotation * frame.origin_m + shift;
    turned.axis_1 = rotation * frame.axis_1;
    turned.axis_2 = rotation * frame.axis_2;
    EXPECT_LT((to_curb(turned, rotation * point + shift) - to_curb(frame, point)).norm(), 1e-10);
  }
}

TEST(CurbFrame, RejectsCurbsAndWidthsThatGiveNoFrame) {
  EXPECT_THROW(frame_of({0, 0}, 0, 15), std::invalid_argument);
  EXPECT_THROW(frame_of({0, 0}, 0, 170), std::invalid_argument);
  EXPECT_THROW(frame_of({0, 0}, 0, 90, 0.0), std::invalid_argument);
  EXPECT_THROW(frame_of({0, 0}, 0, 90, -2.0), std::invalid_argument);
  EXPECT_THROW(make_curb_frame({0, 0}, {0, 0}, {0, 1}, 1.0), std::invalid_argument);
  EXPECT_THROW(make_curb_frame({std::nan(""), 0}, {1, 0}, {0, 1}, 1.0), std::invalid_argument);
  EXPECT_NO_THROW(frame_of({0, 0}, 0, 25));
}

}  // namespace
}  // namespace sila
