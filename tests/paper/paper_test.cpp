// The paper's method linked without the refinement: this program has the objects of core, gp, model, learn, fuse and
// predict alone. tests/refine/paper_alone_test.cpp compares its results with `profile: paper`.

#include <gtest/gtest.h>

#include "support/paper_alone.hpp"

namespace sila {
namespace {

TEST(PaperAlone, LearnsFusesAndPredictsWithoutTheRefinement) {
  const SamplingConfig sampling;
  LearnConfig learning;
  FuseConfig fusing;
  fusing.sites = SiteSharing::shared;
  const Model model = testing::learn_paper_alone(testing::walks_in_widths(60, 3), sampling, learning, fusing);
  EXPECT_EQ(model.episodes, 3);
  EXPECT_EQ(model.tracks, 60);
  PredictConfig config;
  const FlowFieldIndex fields(model, config);
  const FramedTrajectory unseen = testing::walks_in_widths(1, 99).front();
  const std::vector<std::size_t> due = prediction_samples(unseen.track, config.observe_s, 1.0);
  ASSERT_FALSE(due.empty());
  const Prediction prediction =
      predict_by_rollouts(fields, observe(unseen.track, due.front(), unseen.frame, config.observe_s, sampling),
                          sampling.interval_s, config);
  EXPECT_FALSE(prediction.fallback);
  EXPECT_FALSE(prediction.modes.empty());
  EXPECT_TRUE(prediction.regions.empty());
}

}  // namespace
}  // namespace sila
