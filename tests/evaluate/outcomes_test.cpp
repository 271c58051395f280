// Whether stated probabilities of where simulated people will be come true.
#include <gtest/gtest.h>

#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

TEST(Evaluate, OutcomesOfSimulatedPeopleAreCalibrated) {
  const Simulation simulation = simulate({.tracks = 300, .seed = 11});
  const EpisodeConfig config;
  const CurbFrame frame = rescaled(primary_corner(simulation.scene).frame, config.scaling);
  const Split split = split_tracks(testing::framed(simulation.tracks, frame), 0.3, 7, SplitBy::track);
  const Model model = testing::learnt(split.train, config);
  const std::vector<OutcomeScore> outcomes = evaluate(model, split.test, config, {}).outcomes;
  ASSERT_EQ(outcomes.size(), 10);  // of people who stand and who walk, at five horizons
  for (const OutcomeScore& score : outcomes) {
    EXPECT_GT(score.windows, 100);
    EXPECT_LT(score.calibration_error, 0.05) << score.motion_state << ", " << score.horizon_s << " s";
    if (score.motion_state == kWalking) {
      EXPECT_LT(score.brier, 0.85 * score.base_brier) << score.horizon_s << " s";
    }
  }
}

}  // namespace
}  // namespace sila
