#include <gtest/gtest.h>

#include <algorithm>

#include "learn/steps.hpp"
#include "sila/core/sampling.hpp"
#include "sila/learn/learn.hpp"
#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// Unit arrows in a row of cells along x.
MotionPrimitive row(int from, int to, const Vector2& direction) {
  MotionPrimitive primitive;
  for (int x = from; x < to; ++x) primitive.cells.push_back({{x, 0}, direction});
  return primitive;
}

const Grid kGrid{0.4, Vector2::Zero(), 8};

CurbTrajectory straight() {
  return resample(testing::walk("a", {{0.1, 0.5}, {15.9, 0.5}}, 1.25),
                  testing::square_frame(2.5, CurbScaling::mean_width), {});
}

TEST(Segmentation, CutsATrackWhereOnePrimitiveEndsAndTheNextBegins) {
  const std::vector<MotionPrimitive> primitives{row(0, 8, {1, 0}), row(8, 16, {1, 0}), row(0, 16, {-1, 0})};
  const std::vector<Coefficient> code{{0, 1.0}, {1, 0.9}, {2, 0.3}};
  const std::vector<Segment> segments = segment(straight(), code, primitives, kGrid);
  ASSERT_EQ(segments.size(), 2u);
  EXPECT_EQ(segments[0].primitive, 0);
  EXPECT_EQ(segments[1].primitive, 1);
  EXPECT_EQ(segments[0].begin, 0u);
  EXPECT_EQ(segments[0].end, segments[1].begin);
  EXPECT_EQ(segments[1].end, straight().positions.size());
  EXPECT_NEAR(straight().positions[segments[1].begin].x(), 3.2, 0.15);  // cell 8 begins at 3.2 widths
}

TEST(Segmentation, LeavesATrackAloneThatUsesNoPrimitive) {
  const std::vector<MotionPrimitive> primitives{row(0, 8, {1, 0})};
  EXPECT_TRUE(segment(straight(), {}, primitives, kGrid).empty());
  const std::vector<Coefficient> faint{{0, 0.05}};
  EXPECT_TRUE(segment(straight(), faint, primitives, kGrid).empty());
}

TEST(Transitions, CountATrackOnceAPairAndKeepTheSamplesOfBothRuns) {
  const std::vector<CurbTrajectory> tracks{straight(), straight()};
  const std::size_t n = tracks[0].positions.size();
  const std::vector<std::vector<Segment>> segments{{{0, 0, 10}, {1, 10, 20}, {0, 20, 30}, {1, 30, n}}, {{2, 0, n}}};
  const auto observed = observe_transitions(tracks, segments, std::vector{0, 1});
  ASSERT_EQ(observed.size(), 3u);
  EXPECT_EQ(observed.at({0, 1}).sites, (std::vector<SiteCount>{{0, 1.0, 1}}));  // seen twice by one track
  EXPECT_EQ(observed.at({0, 1}).samples.inputs.cols(), static_cast<Eigen::Index>(n));
  EXPECT_EQ(observed.at({1, 0}).samples.inputs.cols(), 20);
  EXPECT_EQ(observed.at({2, 2}).sites, (std::vector<SiteCount>{{1, 1.0, 1}}));
  EXPECT_EQ(observed.at({2, 2}).samples.outputs.rows(), static_cast<Eigen::Index>(n));
}

/// Of one walk at 1.25 m/s.
const std::vector<CurbTrajectory> kWalk{
    resample(testing::walk("a", {{0.0, 0.5}, {16.0, 0.5}}, 1.25), testing::square_frame(), {})};

TEST(ObserveTransitions, TakesSamplesAStrideApartAndCountsAllTracks) {
  const std::size_t samples = kWalk[0].positions.size();
  const std::vector<std::vector<Segment>> segments{{{0, 0, 20}, {1, 20, 22}, {2, 22, samples}}};
  const std::vector<int> sites{0};
  const auto all = observe_transitions(kWalk, segments, sites);
  const auto subsampled = observe_transitions(kWalk, segments, sites, 0.8);
  ASSERT_EQ(all.size(), 2U);
  ASSERT_EQ(subsampled.size(), 2U);
  const double step = (kWalk[0].positions[1] - kWalk[0].positions[0]).norm();
  for (const auto& [key, transition] : subsampled) {
    EXPECT_EQ(total_count(transition.sites), total_count(all.at(key).sites));
    const Eigen::MatrixXd& places = transition.samples.inputs;
    EXPECT_EQ((all.at(key).samples.inputs.cols() - 2 + 3) / 4, places.cols());
    for (Eigen::Index n = 1; n < places.cols(); ++n)
      EXPECT_NEAR((places.col(n) - places.col(n - 1)).norm(), 4.0 * step, 1e-9);
  }
  EXPECT_EQ(all.at({0, 1}).samples.inputs.cols(), 22);
}

TEST(ObserveTransitions, KeepsASampleOfEachStretchHoweverShort) {
  const std::vector<std::vector<Segment>> segments{{{0, 0, 1}}};
  EXPECT_EQ(observe_transitions(kWalk, segments, std::vector<int>{0}, 10.0).at({0, 0}).samples.inputs.cols(), 1);
}

TEST(Learn, MakesAModelThatPassesItsCheckAndCountsEveryTrackOnce) {
  std::vector<CurbTrajectory> tracks;
  for (const FramedTrajectory& placed : testing::corner_walks(20, 3))
    tracks.push_back(resample(placed.track, testing::square_frame(2.5, CurbScaling::mean_width), {}));
  CurbTrajectory standing = tracks.front();
  for (Vector2& velocity : standing.velocities) velocity.setZero();
  tracks.push_back(standing);
  standing.frame.origin_m.x() += 500.0;  // at another site
  tracks.push_back(standing);
  const LearnConfig config;
  const ModelSettings settings =
      begin_settings(tracks.front().frame.sidewalk_width_m, CurbScaling::mean_width, 0.2, config.grid);
  const LearnResult learnt = learn(tracks, settings, config, SiteSharing::apart);
  EXPECT_NO_THROW(check(learnt.increment.model));
  EXPECT_EQ(learnt.increment.samples.size(), learnt.increment.model.transitions.size());
  EXPECT_EQ(learnt.report.standing, 2);
  const auto explained = std::ranges::count_if(learnt.segments, [](const auto& runs) { return !runs.empty(); });
  EXPECT_EQ(explained + learnt.report.unexplained + learnt.report.standing, 22);
  EXPECT_NEAR(settings.grid.cell * 2.5, 1.0, 1e-12);
}

TEST(Learn, RejectsAConfigurationOutOfRangeByName) {
  LearnConfig config;
  config.field.stride_s = -1.0;
  EXPECT_TRUE(says(message_of([&] { learn({}, {}, config); }), "field.stride_s = -1"));
}

}  // namespace
}  // namespace sila
