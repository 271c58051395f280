#include "core/track_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "support/walks.hpp"

namespace sila {
namespace {

/// A path along a direction through a point, both ways of the point.
FramedTrajectory along(const Vector2& middle_m, double angle_rad, double length_m) {
  const Vector2 direction(std::cos(angle_rad), std::sin(angle_rad));
  const auto position_at = [&](int i) { return Vector2(middle_m + direction * ((i - 10) * length_m / 20)); };
  return {testing::sampled(21, 0.1, position_at), {}};
}

TEST(TrackFrame, HasItsOriginAtTheMedianAndItsAxesAlongTheSpread) {
  const std::vector tracks{along({7, -3}, 0.6, 20.0), along({7, -3}, 0.6 + M_PI / 2, 4.0)};
  const CurbFrame frame = frame_of_tracks(tracks);
  EXPECT_EQ(frame.origin_m, Vector2(7, -3));
  EXPECT_NEAR(frame.axis_1.x(), std::cos(0.6), 1e-9);
  EXPECT_NEAR(frame.axis_1.y(), std::sin(0.6), 1e-9);
  EXPECT_NEAR(frame.axis_2.x(), -frame.axis_1.y(), 1e-12);
  EXPECT_NEAR(frame.axis_2.y(), frame.axis_1.x(), 1e-12);
  EXPECT_EQ(frame.sidewalk_width_m, 3.0);
  EXPECT_TRUE(frame.from_tracks);
  EXPECT_EQ(rescaled(frame_of_tracks(tracks), CurbScaling::mean_width).unit_m, Vector2(3, 3));
}

TEST(TrackFrame, MovesAndTurnsWithTheTracks) {
  // Three ways that do not cross in one point, so that the medians depend on the axes.
  const std::vector tracks{along({0, 0}, 0.2, 20.0), along({6, 5}, 1.1, 12.0), along({-3, 8}, 2.4, 9.0)};
  const CurbFrame before = frame_of_tracks(tracks);
  Matrix2 axes;
  axes << before.axis_1, before.axis_2;
  std::vector<Vector2> along_axes;
  for (const FramedTrajectory& entry : tracks)
    for (const Vector2& p : entry.track.positions_m) along_axes.push_back(axes.transpose() * p);
  const Vector2 median_m = axes * median_position(along_axes);
  for (const double angle_rad : {0.5, 1.2, M_PI / 2, 3.0}) {
    const Vector2 ahead(std::cos(angle_rad), std::sin(angle_rad));
    const auto turned = [&](const Vector2& v) {
      return Vector2(v.x() * ahead + v.y() * Vector2(-ahead.y(), ahead.x()));
    };
    std::vector moved = tracks;
    for (FramedTrajectory& entry : moved)
      for (Vector2& p : entry.track.positions_m) p = turned(p) + Vector2(100, 50);
    const CurbFrame after = frame_of_tracks(moved);
    const Vector2 moved_median_m = turned(median_m) + Vector2(100, 50);
    EXPECT_EQ(after.origin_m, Vector2(moved_median_m.array().round()));
    EXPECT_NEAR(std::abs(after.axis_1.dot(turned(before.axis_1))), 1.0, 1e-9);
  }
}

TEST(TrackFrame, OfAPointHasTheAxesOfTheWorldAndOfNothingIsRejected) {
  const FramedTrajectory point{{"1", {0.0, 1.0}, {{4.3, -0.2}, {4.3, -0.2}}}, {}};
  const CurbFrame frame = frame_of_tracks(std::span(&point, 1));
  EXPECT_EQ(frame.origin_m, Vector2(4, 0)) << "the position of a person is not in a model";
  EXPECT_EQ(frame.axis_1, Vector2(1, 0));
  EXPECT_THROW(frame_of_tracks({}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
