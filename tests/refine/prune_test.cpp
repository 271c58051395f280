#include "sila/refine/prune.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "sila/fuse/fuse.hpp"
#include "sila/model/packing.hpp"
#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

/// What a few batches leave, as last seen in whatever episode.
Model grown_model(Random& random, int batches = 4) {
  Model model;
  for (int b = 0; b < batches; ++b) model = fuse(model, random_increment(random)).model;
  for (Transition& transition : model.transitions)
    transition.sites[0].last_episode = integer(random, 0, model.episodes);
  return model;
}

/// `count` people who walk along y = 0 from x = `from_x` on, at 1 width/s.
Transition walk_along(int from, int to, double count, double from_x, double velocity = 1.0) {
  GpData samples{Eigen::MatrixXd(2, 9), Eigen::MatrixXd(9, 2)};
  for (Eigen::Index n = 0; n < 9; ++n) {
    samples.inputs.col(n) << from_x + 0.5 * static_cast<double>(n), 0.0;
    samples.outputs.row(n) << velocity, 0.0;
  }
  return {from, to, count, field_of(samples), {{0, count, 1}}};
}

Model model_of(const std::vector<Transition>& transitions, int episodes = 1) {
  Random random(1);
  Model model;
  model.transitions = transitions;
  model.episodes = episodes;
  model.sites = {{CurbFrame{}, episodes, 20}};
  for (const Transition& transition : transitions) {
    while (static_cast<int>(model.primitives.size()) <= std::max(transition.from, transition.to))
      model.primitives.push_back(random_primitive(random));
  }
  return model;
}

TEST(Prune, DisabledChangesNothing) {
  for_seeds(10, [](Random& random) {
    const Model model = grown_model(random);
    const PruneConfig off{.enabled = false};
    EXPECT_TRUE(identical(prune(model, off).model, model));
    EXPECT_EQ(prune(model, off).kept.size(), model.primitives.size());
  });
}

TEST(Prune, NeverGrowsAModelAndConservesCountsAndPoints) {
  int subsumed = 0;
  for_seeds(20, [&](Random& random) {
    const Model model = grown_model(random);
    const PruneResult small = prune(model, {});
    check(small.model);
    EXPECT_EQ(small.model.transitions.size() + static_cast<std::size_t>(small.report.subsumed),
              model.transitions.size());
    EXPECT_EQ(small.model.primitives.size() + static_cast<std::size_t>(small.report.primitives),
              model.primitives.size());
    EXPECT_EQ(small.kept.size(), small.model.primitives.size());
    EXPECT_NEAR(total_count(small.model), total_count(model), 1e-9 * total_count(model));
    EXPECT_NEAR(total_points(small.model), total_points(model), 1e-9 * total_points(model));
    subsumed += small.report.subsumed;
  });
  EXPECT_GT(subsumed, 20);
}

TEST(Prune, TwiceIsOnce) {
  for_seeds(20, [](Random& random) {
    const PruneResult once = prune(grown_model(random), {});
    const PruneResult twice = prune(once.model, {});
    EXPECT_TRUE(identical(twice.model, once.model));
    EXPECT_EQ(twice.report.subsumed + twice.report.primitives, 0);
  });
}

TEST(Prune, GivesTheSameBytesOnAnyNumberOfThreads) {
  for_seeds(5, [](Random& random) {
    const Model model = grown_model(random);
    const auto on_threads = [&](std::size_t threads) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      return prune(model, {}).model;
    };
    EXPECT_TRUE(identical(on_threads(1), on_threads(2)));
  });
}

TEST(Prune, SubsumesARareTransitionThatAgreesWithAFrequentOne) {
  Model model = model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 0.25)}, 5);
  model.transitions[1].sites[0].last_episode = 4;
  model.transitions[0].support = 12;
  model.transitions[1].support = 1;
  const PruneResult small = prune(model, {});
  EXPECT_EQ(small.report.subsumed, 1);
  EXPECT_EQ(small.kept, (std::vector<int>{0, 1}));
  ASSERT_EQ(small.model.transitions.size(), 1U);
  EXPECT_DOUBLE_EQ(small.model.transitions[0].count, 31.0);
  EXPECT_EQ(small.model.transitions[0].sites[0].last_episode, 4);
  EXPECT_EQ(small.model.transitions[0].support, 12);  // the person may be one of the twelve
}

TEST(Prune, KeepsTransitionsThatDisagreeOrAreElsewhereOrFrequent) {
  EXPECT_EQ(prune(model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 0.25, -1.0)}), {}).report.subsumed, 0);
  EXPECT_EQ(prune(model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 40.0)}), {}).report.subsumed, 0);
  EXPECT_EQ(prune(model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 4, 0.25)}), {}).report.subsumed, 0);
}

TEST(Prune, ExpiredTransitionIsSubsumedByOneThatKnowsThePlace) {
  Model model = model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 0.25, -1.0)}, 11);
  model.transitions[0].sites[0].last_episode = 11;
  const PruneResult small = prune(model, {});
  ASSERT_EQ(small.model.transitions.size(), 1U);
  EXPECT_EQ(small.report.subsumed, 1);
  EXPECT_DOUBLE_EQ(small.model.transitions[0].count, 31.0);
  EXPECT_DOUBLE_EQ(total_points(small.model), total_points(model));
  model.sites[0].episodes = 10;
  EXPECT_EQ(prune(model, {}).report.subsumed, 0) << "not long ago";
  model.sites[0].episodes = 11;
  model.transitions[1].count = 4.0;
  EXPECT_EQ(prune(model, {}).report.subsumed, 0) << "seen four times";
  model.transitions[0].count = model.transitions[1].count = 1.0;
  EXPECT_EQ(prune(model, {}).report.subsumed, 0) << "only by a more frequent one";
}

TEST(Prune, SubsumesNothingOfAnotherSiteWithSitesApart) {
  Model model = model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 0.25)}, 5);
  model.sites.push_back(model.sites[0]);
  model.transitions[1].sites[0].site = 1;
  check(model);
  EXPECT_TRUE(identical(prune(model, {}).model, model));
  model.sites[1].episodes = 100;
  EXPECT_EQ(prune(model, {}).report.subsumed, 0) << "nor what is old";
  model.sharing = SiteSharing::shared;
  const Model small = prune(model, {}).model;
  ASSERT_EQ(small.transitions.size(), 1u);
  EXPECT_EQ(small.transitions[0].sites, (std::vector<SiteCount>{{0, 30.0, 1}, {1, 1.0, 1}}));
}

TEST(Prune, CountsTheAgeOfATransitionInEpisodesOfItsSite) {
  Model model = model_of({walk_along(0, 1, 30, 0.0), walk_along(2, 3, 1, 0.25, -1.0)}, 3);
  model.sites.push_back({CurbFrame{{100.0, 0.0}}, 50, 1000});
  model.episodes = 53;
  EXPECT_EQ(prune(model, {}).report.subsumed, 0);
  model.sites[0].episodes = 11;
  EXPECT_EQ(prune(model, {}).report.subsumed, 1);
}

TEST(Budget, RejectsValuesOutOfRangeAndBudgetsTooSmallForOneTransition) {
  EXPECT_THROW(apply_budget({}, {0.0, 1e9}), std::invalid_argument);
  EXPECT_THROW(apply_budget({}, {10.0, -1.0}), std::invalid_argument);
  EXPECT_THROW(apply_budget({}, {10.0, std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
  const Model model = model_of({walk_along(0, 1, 30, 0.0)});
  Model empty = model;
  empty.primitives.clear();
  empty.transitions.clear();
  const std::string message = message_of([&] { apply_budget(model, {10.0, 100.0}); });
  EXPECT_TRUE(message.ends_with("has " + std::to_string(packed_bytes(empty)) + " bytes")) << message;
  EXPECT_THROW(apply_budget(model, {1.0, 1e9}), std::invalid_argument)
      << "a transition between two primitives needs both";
}

TEST(Budget, ThatIsNotExceededChangesNothing) {
  for_seeds(5, [](Random& random) {
    const Model model = grown_model(random);
    const BudgetResult within =
        apply_budget(model, {static_cast<double>(model.primitives.size()), static_cast<double>(packed_bytes(model))});
    EXPECT_TRUE(identical(within.model, model));
    EXPECT_EQ(within.report.transitions, 0);
  });
}

TEST(Budget, IsNeverExceededWhateverIsLearnt) {
  int evicted = 0;
  for_seeds(15, [&](Random& random) {
    const ModelBudget limits{1.0 * integer(random, 4, 12), uniform(random, 2e4, 1e5)};
    Model model;
    for (int batch = 0; batch < 6; ++batch) {
      const Model before = fuse(model, random_increment(random)).model;
      const BudgetResult within = apply_budget(before, limits);
      model = within.model;
      check(model);
      EXPECT_LE(static_cast<double>(model.primitives.size()), limits.max_primitives);
      EXPECT_LE(static_cast<double>(packed_bytes(model)), limits.max_bytes);
      EXPECT_EQ(model.transitions.size() + static_cast<std::size_t>(within.report.transitions),
                before.transitions.size());
      EXPECT_NEAR(total_count(model) + within.report.count, total_count(before), 1e-9 * total_count(before));
      evicted += within.report.transitions;
    }
  });
  EXPECT_GT(evicted, 50);
}

TEST(Budget, EvictsRareBeforeFrequentAndOverlappedBeforeUnique) {
  const Model by_count = model_of({walk_along(0, 0, 5, 0.0), walk_along(1, 1, 2, 40.0)});
  EXPECT_EQ(apply_budget(by_count, {1.0}).kept, std::vector<int>{0});
  const Model with_loop = model_of({walk_along(0, 0, 3, 0.0), walk_along(1, 2, 5, 40.0)});
  EXPECT_EQ(apply_budget(with_loop, {2.0}).kept, (std::vector<int>{1, 2})) << "a loop counts once for its primitive";
  const Model by_cover = model_of({walk_along(0, 0, 9, 0.0), walk_along(1, 1, 5, 0.25), walk_along(2, 2, 4, 40.0)});
  EXPECT_EQ(apply_budget(by_cover, {2.0}).kept, (std::vector<int>{0, 2}));
  const auto bytes = static_cast<double>(packed_bytes(by_cover));
  EXPECT_EQ(apply_budget(by_cover, {3.0, bytes - 1.0}).kept, (std::vector<int>{0, 2}));
  Model apart = by_cover;  // at another site nothing else knows the place
  apart.sites.push_back(apart.sites[0]);
  apart.transitions[1].sites[0].site = 1;
  EXPECT_EQ(apply_budget(apart, {2.0}).kept, (std::vector<int>{0, 1}));
}

}  // namespace
}  // namespace sila
