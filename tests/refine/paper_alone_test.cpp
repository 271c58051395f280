// With the profile `paper` the refinement changes nothing.

#include "support/paper_alone.hpp"

#include <gtest/gtest.h>

#include "sila/config.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

TEST(PaperAlone, IsWhatTheProfileOfThePaperDoes) {
  const EpisodeConfig config = with_profile({}, "paper").episode;
  const std::vector<FramedTrajectory> tracks = testing::walks_in_widths(60, 3);
  const Model whole = testing::learnt(tracks, config);
  const Model alone = testing::learn_paper_alone(tracks, config.sampling, config.learn, config.fuse);
  ASSERT_EQ(alone.primitives.size(), whole.primitives.size());
  ASSERT_EQ(alone.transitions.size(), whole.transitions.size());
  const Predictor predictor(whole, config.predict);
  const FlowFieldIndex fields(alone, config.predict);
  int predictions = 0;
  for (const Window& window : windows_of(testing::walks_in_widths(10, 77), config.sampling, config.predict, 1.0)) {
    const Prediction a = predictor.predict(window.observed);
    const Prediction b = predict_by_rollouts(fields, window.observed, config.sampling.interval_s, config.predict);
    ASSERT_EQ(a.modes.size(), b.modes.size());
    EXPECT_EQ(a.novelty, b.novelty);
    EXPECT_EQ(a.fallback, b.fallback);
    for (std::size_t m = 0; m < a.modes.size(); ++m) {
      EXPECT_EQ(a.modes[m].weight, b.modes[m].weight);
      EXPECT_EQ(a.modes[m].path_m, b.modes[m].path_m);
      EXPECT_EQ(a.modes[m].covariances_m2, b.modes[m].covariances_m2);
      EXPECT_EQ(a.modes[m].primitives, b.modes[m].primitives);
    }
    ++predictions;
  }
  EXPECT_GT(predictions, 20);
}

}  // namespace
}  // namespace sila
