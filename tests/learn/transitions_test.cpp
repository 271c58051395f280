#include "learn/transitions.hpp"

#include <gtest/gtest.h>

#include "sila/core/sampling.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

TEST(ObserveTransitions, TakesSamplesAStrideApartAndCountsAllTracks) {
  const std::vector<CurbTrajectory> tracks{
      resample(testing::walk("a", {{0.0, 0.5}, {16.0, 0.5}}, 1.25), testing::square_frame(), {})};
  const std::size_t samples = tracks[0].positions.size();
  const std::vector<std::vector<Segment>> segments{{{0, 0, 20}, {1, 20, 22}, {2, 22, samples}}};
  const std::vector<int> sites{0};
  const auto all = observe_transitions(tracks, segments, sites);
  const auto subsampled = observe_transitions(tracks, segments, sites, 0.8);
  ASSERT_EQ(all.size(), 2U);
  ASSERT_EQ(subsampled.size(), 2U);
  const double step = (tracks[0].positions[1] - tracks[0].positions[0]).norm();
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
  const std::vector<CurbTrajectory> tracks{
      resample(testing::walk("a", {{0.0, 0.5}, {16.0, 0.5}}, 1.25), testing::square_frame(), {})};
  const std::vector<std::vector<Segment>> segments{{{0, 0, 1}}};
  EXPECT_EQ(observe_transitions(tracks, segments, std::vector<int>{0}, 10.0).at({0, 0}).samples.inputs.cols(), 1);
}

}  // namespace
}  // namespace sila
