#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/sim/simulate.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

Simulation simulated(Layout layout, int seed) {
  return simulate({.layout = layout, .tracks = 150, .seed = static_cast<std::uint64_t>(seed)});
}

double degrees_between(const Vector2& a, const Vector2& b) {
  return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) * 180.0 / M_PI;
}

TEST(CornerProposal, FindsTheCornerOfEveryLayout) {
  for (const Layout layout : {Layout::four_way, Layout::t_junction, Layout::acute, Layout::obtuse}) {
    for (const int seed : {4, 5}) {
      SCOPED_TRACE(std::string(kLayoutNames[static_cast<std::size_t>(layout)]) + ", seed " + std::to_string(seed));
      const Simulation world = simulated(layout, seed);
      const CurbFrame& truth = primary_corner(world.scene).frame;
      const CornerProposal made = propose_corner(world.tracks);
      EXPECT_LT((made.frame.origin_m - truth.origin_m).norm(), 1.5);
      EXPECT_LT(degrees_between(made.frame.axis_1, truth.axis_1), 10.0);
      EXPECT_LT(degrees_between(made.frame.axis_2, truth.axis_2), 10.0);
      EXPECT_NEAR(made.widths.width_1_m, 3.0, 1.3);  // people keep away from the curb and the wall
      EXPECT_NEAR(made.widths.width_2_m, 3.0, 1.3);
      EXPECT_GT(made.origin_error_m, 0.0);
      EXPECT_LT(made.origin_error_m, 1.0);
      EXPECT_LT(made.axis_error_rad, 0.1);
      EXPECT_GE(made.turning_tracks, 10U);
      EXPECT_GT(std::min(made.share_1, made.share_2), 0.3);
    }
  }
}

TEST(CornerProposal, MovesAndTurnsWithTheTracks) {
  Simulation world = simulated(Layout::acute, 6);
  const CornerProposal before = propose_corner(world.tracks);
  const auto turned = [](const Vector2& p) { return Vector2(0.6 * p.x() - 0.8 * p.y(), 0.8 * p.x() + 0.6 * p.y()); };
  for (Trajectory& track : world.tracks) {
    for (Vector2& p : track.positions_m) p = turned(p) + Vector2(1000, -500);
  }
  const CornerProposal after = propose_corner(world.tracks);
  EXPECT_LT((after.frame.origin_m - turned(before.frame.origin_m) - Vector2(1000, -500)).norm(), 0.3);
  EXPECT_LT(degrees_between(after.frame.axis_1, turned(before.frame.axis_1)), 1.0);
  EXPECT_LT(degrees_between(after.frame.axis_2, turned(before.frame.axis_2)), 1.0);
}

TEST(CornerProposal, IsTheSameCornerWhereYPointsDown) {
  Simulation world = simulated(Layout::acute, 6);
  const CornerProposal up = propose_corner(world.tracks);
  const auto mirrored = [](const Vector2& p) { return Vector2(p.x(), -p.y()); };
  for (Trajectory& track : world.tracks) {
    for (Vector2& p : track.positions_m) p = mirrored(p);
  }
  const CornerProposal down = propose_corner(world.tracks, true);
  EXPECT_LT((down.frame.origin_m - mirrored(up.frame.origin_m)).norm(), 0.3);
  EXPECT_LT(degrees_between(down.frame.axis_1, mirrored(up.frame.axis_1)), 1.0);
  EXPECT_LT(degrees_between(down.frame.axis_2, mirrored(up.frame.axis_2)), 1.0);
  EXPECT_NEAR(down.widths.width_1_m, up.widths.width_1_m, 0.3);
}

TEST(CornerProposal, NeedsTenTracksAndTwoDirections) {
  std::vector<Trajectory> tracks;
  EXPECT_THROW(propose_corner(tracks), std::invalid_argument);
  for (int i = 0; i < 12; ++i) {
    const auto position_at = [&](int k) { return Vector2(0.3 * k, 0.1 * i); };
    tracks.push_back(testing::sampled(40, 0.25, position_at, std::to_string(i)));
  }
  EXPECT_THROW(propose_corner(tracks), std::invalid_argument);
  for (Trajectory& track : tracks) {  // and too few that move
    for (Vector2& p : track.positions_m) p *= 0.1;
  }
  EXPECT_THROW(propose_corner(tracks), std::invalid_argument);
}

}  // namespace
}  // namespace sila
