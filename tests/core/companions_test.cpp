// The people who walk along with a person, by what was seen of them until t0.
#include "sila/core/companions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "sila/train/episode.hpp"
#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// For 6 s.
Trajectory walk(const std::string& id, const Vector2& start_m, const Vector2& velocity_mps) {
  return testing::sampled(
      61, 0.1, [&](int k) { return Vector2(start_m + 0.1 * k * velocity_mps); }, id);
}

TEST(Companions, MotionIsThatOfTheLastSamplesAlone) {
  Trajectory track = walk("a", {0, 0}, {1, 0});
  for (std::size_t i = 31; i < track.positions_m.size(); ++i) track.positions_m[i] += Vector2(0, 50);
  const auto motion = motion_at(track, 3.04);
  ASSERT_TRUE(motion);
  EXPECT_TRUE(motion->velocity_mps.isApprox(Vector2(1, 0)));
  EXPECT_TRUE(motion->position_m.isApprox(Vector2(3.04, 0)));
}

TEST(Companions, MotionNeedsTwoRecentSamples) {
  const Trajectory track = walk("a", {0, 0}, {1, 0});
  EXPECT_FALSE(motion_at(track, 0.0));
  EXPECT_TRUE(motion_at(track, 0.1));
  EXPECT_TRUE(motion_at(track, 6.45));
  EXPECT_FALSE(motion_at(track, 6.6));
  const Trajectory slow{"b", {0.0, 1.0}, {{0, 0}, {2, 0}}, 0};  // a tracker of 1 Hz
  EXPECT_TRUE(motion_at(slow, 1.0)->velocity_mps.isApprox(Vector2(2, 0)));
}

TEST(Companions, WithFewerPositionsThanTimesAreRejected) {
  const Trajectory track = walk("a", {0, 0}, {1, 0});
  Trajectory other = walk("b", {0, 1}, {1, 0});
  other.positions_m.pop_back();
  const Trajectory* const others[] = {&other};
  EXPECT_TRUE(says(message_of([&] { companions_mps(track, 20, others); }), "track 'b' has 60 positions"));
}

TEST(Companions, CountByDistanceAndVelocity) {
  const MotionState own{{0, 0}, {1.2, 0}};
  const auto of = [&](const Vector2& position_m, const Vector2& velocity_mps) {
    const MotionState other{position_m, velocity_mps};
    return companions_mps(own, std::span(&other, 1));
  };
  EXPECT_EQ(companions_mps(own, {}), Vector2::Zero());
  const Vector2 beside = of({0, 0.7}, {1.2, 0.2});
  EXPECT_NEAR(beside.x(), 0.0, 1e-12);
  EXPECT_GT(beside.y(), 0.1);
  EXPECT_LT(beside.y(), 0.2);
  EXPECT_LT(of({0, 6}, {1.2, 0.2}).norm(), 1e-6);
  EXPECT_LT(of({0, 0.7}, {-1.2, 0.2}).norm(), 1e-3);  // a person who comes the other way
}

TEST(Companions, TurnWithTheWorld) {
  const MotionState own{{1, 2}, {1.2, 0.3}}, other{{1.5, 2.4}, {1.0, 0.5}};
  const Matrix2 turn = Eigen::Rotation2Dd(0.8).toRotationMatrix();
  const MotionState turned{turn * own.position_m, turn * own.velocity_mps},
      other_turned{turn * other.position_m, turn * other.velocity_mps};
  const Vector2 expected = turn * companions_mps(own, std::span(&other, 1));
  EXPECT_TRUE(companions_mps(turned, std::span(&other_turned, 1)).isApprox(expected));
}

TEST(Companions, AreOtherPeopleOfTheSameRecordingUntilThen) {
  std::vector<FramedTrajectory> tracks = {{walk("a", {0, 0}, {1.2, 0}), {}}, {walk("b", {0, 0.8}, {1.2, 0.2}), {}}};
  const Trajectory& own = tracks[0].track;
  const Vector2 seen = PresentPeople(tracks).companions_mps(own, 20);
  EXPECT_GT(seen.y(), 0.05);
  std::vector<FramedTrajectory> changed = tracks;
  for (std::size_t i = 21; i < changed[1].track.positions_m.size(); ++i) changed[1].track.positions_m[i] *= -3.0;
  EXPECT_EQ(PresentPeople(changed).companions_mps(own, 20), seen);
  changed = tracks;
  changed[1].track.recording = 1;
  EXPECT_EQ(PresentPeople(changed).companions_mps(own, 20), Vector2::Zero());
  changed = tracks;
  changed[1].track.id = "a";
  EXPECT_EQ(PresentPeople(changed).companions_mps(own, 20), Vector2::Zero());
  EXPECT_EQ(PresentPeople({}).companions_mps(own, 20), Vector2::Zero());
}

TEST(Companions, OfAWindowAreAmongTheGivenTracksOrThePeopleGiven) {
  const CurbFrame frame = make_curb_frame({0, 0}, {1, 0}, {0, 1}, 3);
  const std::vector<FramedTrajectory> both = {{walk("a", {0, 0}, {1.2, 0}), frame},
                                              {walk("b", {0, 0.8}, {1.2, 0.2}), frame}};
  const PresentPeople present(both);
  const auto first = std::span(both).first(1);
  EXPECT_GT(windows_of(both, {}, {}, 1.0).front().observed.companions_mps.y(), 0.05);
  EXPECT_EQ(windows_of(first, {}, {}, 1.0).front().observed.companions_mps, Vector2::Zero());
  EXPECT_EQ(windows_of(first, {}, {}, 1.0, {}, &present).front().observed.companions_mps,
            windows_of(both, {}, {}, 1.0).front().observed.companions_mps);
}

}  // namespace
}  // namespace sila
