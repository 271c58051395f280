#include <gtest/gtest.h>

#include <cmath>

#include "support/polygon.hpp"

namespace sila {
namespace {

IntersectionScene scene_of(Layout layout) {
  return simulated_scene({.layout = layout});
}

double cross(const Vector2& a, const Vector2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double area_m2(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) twice += cross(polygon[j], polygon[i]);
  return 0.5 * twice;
}

TEST(SimulatedScene, HasThePrimaryCornerOfItsAngle) {
  const std::pair<Layout, double> cases[] = {
      {Layout::four_way, 90.0}, {Layout::t_junction, 90.0}, {Layout::acute, 60.0}, {Layout::obtuse, 120.0}};
  for (const auto& [layout, degrees] : cases) {
    const CurbFrame frame = primary_corner(scene_of(layout)).frame;
    EXPECT_NEAR(std::acos(frame.axis_1.dot(frame.axis_2)) * 180.0 / std::acos(-1.0), degrees, 1e-9);
  }
}

TEST(SimulatedScene, HasFourCornersOrThreeSidewalksWithTwo) {
  for (Layout layout : {Layout::four_way, Layout::acute, Layout::obtuse}) {
    EXPECT_EQ(scene_of(layout).corners.size(), 4U);
    EXPECT_EQ(scene_of(layout).crosswalks.size(), 4U);
  }
  EXPECT_EQ(scene_of(Layout::t_junction).corners.size(), 2U);
  EXPECT_EQ(scene_of(Layout::t_junction).sidewalks.size(), 3U);
  EXPECT_EQ(scene_of(Layout::t_junction).crosswalks.size(), 3U);
}

TEST(SimulatedScene, TurnsAxesAndPolygonsCounterClockwise) {
  for (Layout layout : {Layout::four_way, Layout::t_junction, Layout::acute, Layout::obtuse}) {
    const IntersectionScene scene = scene_of(layout);
    for (const NamedCorner& corner : scene.corners) EXPECT_GT(cross(corner.frame.axis_1, corner.frame.axis_2), 0.0);
    for (const auto* polygons : {&scene.sidewalks, &scene.crosswalks, &scene.buildings})
      for (const Polygon& polygon : *polygons) EXPECT_GT(area_m2(polygon), 0.0) << scene.name;
  }
}

TEST(SimulatedScene, PutsTheCurbsAtTheEdgeOfTheRoadAndTheWallBehindTheSidewalk) {
  const IntersectionScene scene = scene_of(Layout::four_way);
  EXPECT_EQ(primary_corner(scene).frame.origin_m, Vector2(4.0, 4.0));
  EXPECT_TRUE(contains(scene.sidewalks.front(), {15.0, 4.1}));
  EXPECT_TRUE(contains(scene.sidewalks.front(), {15.0, 6.9}));
  EXPECT_FALSE(contains(scene.sidewalks.front(), {15.0, 3.9}));
  EXPECT_TRUE(contains(scene.buildings.front(), {15.0, 7.1}));
  EXPECT_FALSE(contains(scene.buildings.front(), {15.0, 6.9}));
}

TEST(SimulatedScene, LaysEachCrosswalkFromCurbToCurb) {
  // 8 m of road, 3 m of sidewalk and 0.5 m on each side; at a slant the same height over a longer base.
  for (const Polygon& crosswalk : scene_of(Layout::four_way).crosswalks)
    EXPECT_NEAR(area_m2(crosswalk), 8.0 * 4.0, 1e-9);
  for (const Polygon& crosswalk : scene_of(Layout::acute).crosswalks)
    EXPECT_NEAR(area_m2(crosswalk), 8.0 * 4.0 / std::sqrt(0.75), 1e-9);
}

TEST(SimulatedScene, SaysInsideAndOutsideOfAConcavePolygon) {
  const Polygon hook{{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {0, 1}};
  EXPECT_TRUE(contains(hook, {2.5, 2.5}));
  EXPECT_TRUE(contains(hook, {0.5, 0.5}));
  EXPECT_FALSE(contains(hook, {1.0, 2.0}));
  EXPECT_FALSE(contains(hook, {4.0, 0.5}));
}

}  // namespace
}  // namespace sila
