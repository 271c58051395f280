// The figures of the profiles on simulated tracks, within bands.

#include <gtest/gtest.h>

#include "sila/config.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

Split simulated_split(CurbScaling scaling) {
  const Simulation simulation = simulate({.tracks = 160, .seed = 4, .occlusions_per_min = 0.0});
  const CurbFrame frame = rescaled(primary_corner(simulation.scene).frame, scaling);
  return split_tracks(testing::framed(simulation.tracks, frame), 0.25, 7, SplitBy::track);
}

/// Weighted error over that of constant velocity on the same moving windows.
double ratio(const EpisodeConfig& config, const Update& update) {
  const Split split = simulated_split(config.scaling);
  const Model model = run_episodes({}, split.train, 20, config, update).model;
  for (const GroupScore& group : evaluate(model, split.test, config, {}).groups) {
    if (group.name == "moving") return group.model.back().weighted_mhd_m / group.constant.back().weighted_mhd_m;
  }
  return 0.0;
}

TEST(Profile, FiguresOnSimulatedTracksStayWithinTheirBands) {
  const EpisodeConfig paper = with_profile({}, "paper").episode, literal = with_profile({}, "paper-literal").episode;
  const double fused = ratio(paper, sila_update(paper)), sum = ratio(paper, accumulate_update(paper));
  const double to_the_letter = ratio(literal, sila_update(literal));
  // Measured: .726, .722 and 1.069. The bands allow for another split of so few people.
  EXPECT_GT(fused, 0.62);
  EXPECT_LT(fused, 0.82);
  EXPECT_NEAR(fused, sum, 0.03);
  EXPECT_GT(to_the_letter, fused + 0.1);
}

}  // namespace
}  // namespace sila
