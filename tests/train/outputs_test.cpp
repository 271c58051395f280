// Fields of two GPs, one for each component of the velocity, through everything that a model goes through.

#include <gtest/gtest.h>

#include "sila/config.hpp"
#include "sila/model/packing.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

EpisodeConfig with_outputs(FieldOutputs outputs) {
  EpisodeConfig config = with_profile({}, "paper").episode;
  config.learn.field.outputs = outputs;
  return config;
}

TEST(IndependentOutputs, PredictAsSharedOnesUnderOneTheta) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(80, 11);
  EpisodeConfig shared = with_outputs(FieldOutputs::shared), independent = with_outputs(FieldOutputs::independent);
  for (const bool pruned : {false, true}) {
    SCOPED_TRACE(pruned);
    shared.prune.enabled = independent.prune.enabled = pruned;
    const Model a = testing::learnt(tracks, shared), b = testing::learnt(tracks, independent);
    EXPECT_NO_THROW(check(b));
    ASSERT_EQ(size(a), size(b));
    const Predictor first(a, shared.predict), second(b, shared.predict);
    for (const Window& window : windows_of(testing::corner_walks(10, 77), shared.sampling, shared.predict, 2.0)) {
      const Prediction p = first.predict(window.observed), q = second.predict(window.observed);
      ASSERT_EQ(p.modes.size(), q.modes.size());
      for (std::size_t m = 0; m < p.modes.size(); ++m) {
        EXPECT_NEAR(p.modes[m].weight, q.modes[m].weight, 1e-6);
        EXPECT_LT((p.modes[m].path_m.back() - q.modes[m].path_m.back()).norm(), 1e-6);
        EXPECT_LT((p.modes[m].covariances_m2.back() - q.modes[m].covariances_m2.back()).norm(), 1e-6);
      }
    }
  }
}

TEST(IndependentOutputs, HaveAThetaAndPseudoInputsOfTheirOwn) {
  EpisodeConfig config = with_profile({}, "paper-literal").episode;
  const Model model = testing::learnt(testing::corner_walks(40, 5), config);
  std::size_t apart = 0;
  for (const Transition& transition : model.transitions) {
    ASSERT_TRUE(transition.field.independent());
    const SparseGp &x = transition.field.gp, &y = transition.field.gp_y;
    const bool same_inputs = x.pseudo_inputs.cols() == y.pseudo_inputs.cols() && x.pseudo_inputs == y.pseudo_inputs;
    apart += x.kernel != y.kernel && !same_inputs;
  }
  EXPECT_GT(apart, 0U);
  EXPECT_NO_THROW(check(model));
}

TEST(IndependentOutputs, ArePackedBitForBit) {
  const Model model = testing::learnt(testing::corner_walks(20, 6), with_outputs(FieldOutputs::independent));
  for (const Transition& transition : model.transitions) {
    const FlowField again = unpack<FlowField>(pack(transition.field));
    EXPECT_TRUE(again.gp == transition.field.gp && again.gp_y == transition.field.gp_y);
  }
}

TEST(IndependentOutputs, AreNotMixedWithSharedOnes) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(40, 7);
  const Model shared = testing::learnt(std::span(tracks).first(20), with_outputs(FieldOutputs::shared));
  const EpisodeConfig independent = with_outputs(FieldOutputs::independent);
  EXPECT_THROW(run_episode(shared, std::span(tracks).last(20), independent), std::invalid_argument);
  Model mixed = shared;
  mixed.transitions.back().field = testing::learnt(std::span(tracks).last(20), independent).transitions.back().field;
  EXPECT_THROW(check(mixed), std::invalid_argument);
}

}  // namespace
}  // namespace sila
