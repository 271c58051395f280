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
    EXPECT_EQ(a.novelty, b.novelty);
    EXPECT_EQ(a.fallback, b.fallback);
    EXPECT_EQ(a.modes, b.modes);
    ++predictions;
  }
  EXPECT_GT(predictions, 20);
}

}  // namespace
}  // namespace sila
