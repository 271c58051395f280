#include "sila/evaluate/compare.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/indices.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

Model learnt(int tracks) {
  return testing::learnt(testing::corner_walks(tracks, 2));
}

/// The same model with its primitives numbered the other way round.
Model renumbered(Model model) {
  const auto last = static_cast<int>(model.primitives.size()) - 1;
  std::ranges::reverse(model.primitives);
  for (Transition& edge : model.transitions) {
    edge.from = last - edge.from;
    edge.to = last - edge.to;
  }
  std::ranges::reverse(model.transitions);  // by (from, to) again
  std::ranges::reverse(model.refinement.residuals);
  return model;
}

TEST(Compare, AModelWithItselfDiffersInNothingHoweverItIsNumbered) {
  const Model model = learnt(60);
  for (const Model& other : {model, renumbered(model)}) {
    const ModelComparison comparison = compare(model, other, 0.7);
    EXPECT_EQ(comparison.same_primitives, model.primitives.size());
    EXPECT_EQ(comparison.same_transitions, model.transitions.size());
    EXPECT_TRUE(comparison.changed_primitives.empty() && comparison.changed_transitions.empty());
    EXPECT_TRUE(comparison.primitives_of_a.empty() && comparison.primitives_of_b.empty());
    EXPECT_TRUE(comparison.transitions_of_a.empty() && comparison.transitions_of_b.empty());
  }
  const std::vector<CurbTrajectory> paths = traced_paths(model, 3.2);
  EXPECT_GT(paths.size(), 20u);
  const Predictor predictor(model, kConfig.predict);
  const std::vector<HorizonDifference> apart = compare_predictions(predictor, predictor, paths);
  ASSERT_EQ(apart.size(), 5u);
  for (const HorizonDifference& horizon : apart) EXPECT_EQ(horizon.max_m, 0.0);
}

TEST(Compare, NamesWhatWasTakenOutAndWhatWasChanged) {
  const Model model = learnt(60);
  Model other = model;
  Transition& edge = other.transitions[1];
  edge.count += 1.0;
  const std::pair changed(edge.from, edge.to), gone(other.transitions[0].from, other.transitions[0].to);
  other.transitions.erase(other.transitions.begin());
  other.refinement.residuals.erase(other.refinement.residuals.begin());
  Vector2& arrow = other.primitives[0].cells[0].velocity;
  arrow = 0.9 * arrow;
  const ModelComparison comparison = compare(model, other, 0.7);
  ASSERT_EQ(comparison.changed_primitives.size(), 1u);
  EXPECT_EQ(comparison.changed_primitives[0].a, 0);
  EXPECT_EQ(comparison.changed_primitives[0].b, 0);
  EXPECT_EQ(comparison.transitions_of_a, std::vector{gone});
  ASSERT_EQ(comparison.changed_transitions.size(), 1u);
  EXPECT_EQ(comparison.changed_transitions[0].a, changed);
  EXPECT_EQ(comparison.changed_transitions[0].count_b, comparison.changed_transitions[0].count_a + 1.0);
  EXPECT_EQ(comparison.same_transitions, model.transitions.size() - 2);
  const ModelComparison back = compare(other, model, 0.7);
  EXPECT_EQ(back.transitions_of_b, std::vector{gone});
  EXPECT_TRUE(back.transitions_of_a.empty());
}

TEST(Compare, PairsNoPrimitivesOfSitesThatAreApart) {
  Model model = learnt(60);
  model.refinement = {};
  Model elsewhere = model;
  elsewhere.sites[0].frame.origin_m.x() += 100.0;
  const std::size_t primitives = model.primitives.size();
  EXPECT_EQ(compare(model, elsewhere, 0.7).primitives_of_a.size(), primitives);
  const ModelComparison of_both = compare(accumulate(model, {elsewhere, {}}).model, elsewhere, 0.7);
  EXPECT_EQ(of_both.same_primitives, primitives);
  EXPECT_EQ(of_both.primitives_of_a, indices<int>(primitives)) << "of the other site";
  model.sharing = elsewhere.sharing = SiteSharing::shared;
  EXPECT_EQ(compare(model, elsewhere, 0.7).same_primitives, primitives);
}

TEST(Compare, PredictionsOfMoreTracksDifferMoreTheFartherTheyGo) {
  const Model few = learnt(20), many = learnt(100);
  const Predictor of_few(few, kConfig.predict), of_many(many, kConfig.predict);
  const std::vector<HorizonDifference> apart = compare_predictions(of_few, of_many, traced_paths(many, 3.2));
  ASSERT_EQ(apart.size(), 5u);
  EXPECT_GT(apart.back().mean_m, 0.01);
  EXPECT_GT(apart.back().mean_m, apart.front().mean_m);
  EXPECT_GE(apart.back().max_m, apart.back().mean_m);
}

TEST(Compare, TracesAtMostTheRequestedPathsAndNoneThatStands) {
  const Model model = learnt(60);
  EXPECT_EQ(traced_paths(model, 3.2, 7).size(), 7u);
  for (const CurbTrajectory& path : traced_paths(model, 3.2)) {
    EXPECT_EQ(path.positions.size(), 16u);
    EXPECT_NO_THROW(validate(path));
    EXPECT_GE(velocity_to_world(path.frame, path.velocities.back()).norm(), 0.2);
  }
}

TEST(Compare, RejectsModelsWithOtherSettings) {
  const Model model = learnt(20);
  Model other = model;
  other.settings.reference_width_m = 3.0;
  EXPECT_THROW(compare(model, other, 0.7), std::invalid_argument);
}

}  // namespace
}  // namespace sila
