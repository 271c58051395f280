#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "refine/refine.hpp"
#include "sila/model/packing.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

/// SILA's update as it is without anything that keeps a model small.
Update only_learn_and_fuse(const EpisodeConfig& config) {
  return [config](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    const LearnResult incoming = learn(batch, settings, config.learn, config.residual);
    FuseResult fused = fuse(previous, incoming.increment, config.fuse, config.residual);
    ModelChange change = change_by(fused.plan, previous, fused.model);
    Episode episode{std::move(fused.model), {}};
    episode.report.learn = incoming.report;
    episode.report.change = std::move(change);
    return episode;
  };
}

TEST(Growth, WithoutPruningTheModelIsThatOfLearningAndFusing) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(80, 4);
  EpisodeConfig off = kConfig;
  off.prune.enabled = false;
  const Model plain = run_episodes({}, tracks, 20, off, only_learn_and_fuse(off)).model;
  EXPECT_TRUE(identical(testing::learnt(tracks, off), plain));
}

// Which primitives a batch gives depends on rounding, so that one run more or less proves nothing: four seeds of 15
// episodes, more than `expire_after_episodes`, give 77 with pruning and 89 without.
TEST(Growth, PruningMakesModelsSmaller) {
  EpisodeConfig off = kConfig;
  off.prune.enabled = false;
  std::size_t pruned = 0, plain = 0;
  for (const unsigned seed : {4U, 5U, 6U, 7U}) {
    const std::vector<FramedTrajectory> tracks = testing::corner_walks(150, seed);
    pruned += size(run_episodes({}, tracks, 10, kConfig, sila_update(kConfig)).model);
    plain += size(run_episodes({}, tracks, 10, off, sila_update(off)).model);
  }
  EXPECT_LT(pruned, plain);
}

TEST(Growth, ABudgetHoldsAfterEveryEpisodeAndEvictionsAreReported) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(100, 6);
  Model rest = testing::learnt(tracks);
  const auto most = static_cast<double>(packed_bytes(rest));
  rest.primitives.clear();
  rest.transitions.clear();
  const auto least = static_cast<double>(packed_bytes(rest));
  EpisodeConfig capped = kConfig;
  capped.budget.max_bytes = least + 0.7 * (most - least);
  capped.budget.max_primitives = 12;
  int evicted = 0;
  run_episodes({}, tracks, 20, capped, sila_update(capped), [&](int number, const Model&, const Episode& episode) {
    SCOPED_TRACE("episode " + std::to_string(number));
    EXPECT_LE(static_cast<double>(packed_bytes(episode.model)), capped.budget.max_bytes);
    EXPECT_LE(episode.model.primitives.size(), 12U);
    EXPECT_EQ(episode.report.change.primitives_after, static_cast<int>(episode.model.primitives.size()));
    EXPECT_NO_THROW(check(episode.model));
    evicted += episode.report.budget.transitions;
  });
  EXPECT_GT(evicted, 0);
}

TEST(Growth, WhereBytesAreShortResidualsLoseDetailBeforeATransitionGoes) {
  const Model model = testing::learnt(testing::corner_walks(100, 6));
  const auto most_inputs = [](const Model& of) {
    Eigen::Index most = 0;
    for (const SparseGp& residual : of.refinement.residuals) most = std::max(most, residual.pseudo_inputs.cols());
    return most;
  };
  ASSERT_GT(most_inputs(model), 30);
  Model rest = model;
  rest.primitives.clear();
  rest.transitions.clear();
  const auto least = static_cast<double>(packed_bytes(rest)), most = static_cast<double>(packed_bytes(model));
  const double nearly_all = least + 0.95 * (most - least), a_third = least + 0.33 * (most - least);
  const BudgetResult little = apply_budget(model, {.max_bytes = nearly_all});
  EXPECT_GT(little.report.reduced, 0);
  EXPECT_EQ(little.report.transitions, 0);
  EXPECT_LE(static_cast<double>(packed_bytes(little.model)), nearly_all);
  EXPECT_NO_THROW(check(little.model));
  double most_of_reduced = 0.0, least_of_others = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < model.transitions.size(); ++i) {
    const SparseGp &before = entry_of(model.refinement.residuals, i),
                   &after = entry_of(little.model.refinement.residuals, i);
    EXPECT_EQ(after.points, before.points);
    const double count = model.transitions[i].count;
    if (after.pseudo_inputs.cols() > 30)
      least_of_others = std::min(least_of_others, count);
    else if (before.pseudo_inputs.cols() > 30)
      most_of_reduced = std::max(most_of_reduced, count);
    EXPECT_GE(after.pseudo_inputs.cols(), std::min<Eigen::Index>(before.pseudo_inputs.cols(), 30));
  }
  EXPECT_GT(most_of_reduced, 0.0);
  EXPECT_LE(most_of_reduced, least_of_others);  // the rarest first
  const BudgetResult much = apply_budget(model, {.max_bytes = a_third});
  EXPECT_GT(much.report.transitions, 0);
  EXPECT_LE(most_inputs(much.model), 30);
}

}  // namespace
}  // namespace sila
