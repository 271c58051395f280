#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "fuse/steps.hpp"
#include "sila/fuse/fuse.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

/// A random problem; coarse similarities, so that ties are common.
FusionProblem random_problem(Random& random) {
  FusionProblem problem;
  problem.similarity_threshold = 0.1 * integer(random, 4, 9);
  problem.previous_primitives = integer(random, 0, 9);
  problem.incoming_primitives = integer(random, 0, 9);
  const int n = problem.primitives();
  const int density = integer(random, 1, 10);
  for (int a = 0; a < n; ++a) {
    for (int b = a + 1; b < n; ++b) {
      if (integer(random, 1, 10) <= density) problem.similarities.push_back({a, b, 0.05 * integer(random, 0, 20)});
    }
    for (int b = 0; b < n; ++b) {
      const bool same_model = (a < problem.previous_primitives) == (b < problem.previous_primitives);
      if (same_model && integer(random, 1, 4) == 1) problem.transitions.push_back({a, b, 1.0 * integer(random, 1, 6)});
    }
  }
  return problem;
}

FusionRules random_rules(Random& random) {
  const auto flip = [&random] { return integer(random, 0, 1) == 1; };
  return {flip(), flip(), flip(), flip(), flip()};
}

double total(const std::vector<TransitionCount>& transitions) {
  return std::accumulate(transitions.begin(), transitions.end(), 0.0,
                         [](double sum, const TransitionCount& edge) { return sum + edge.count; });
}

/// Relaxing as the text has it, one edge at a time and recomputing components: slow, for comparison.
void relax_one_by_one(SimilarityEdges component, std::vector<SimilarityEdges>& parts, SimilarityEdges& removed) {
  if (component.size() <= 2) {
    parts.push_back(component);
    return;
  }
  auto weakest = component.begin();
  for (auto edge = component.begin(); edge != component.end(); ++edge) {
    const bool weaker = edge->value < weakest->value;
    const bool tie = edge->value == weakest->value;
    if (weaker || (tie && std::pair(edge->first, edge->second) > std::pair(weakest->first, weakest->second)))
      weakest = edge;
  }
  removed.push_back(*weakest);
  component.erase(weakest);
  for (const SimilarityEdges& rest : connected_components(component)) relax_one_by_one(rest, parts, removed);
}

std::set<std::tuple<int, int>> positions(const SimilarityEdges& edges) {
  std::set<std::tuple<int, int>> result;
  for (const Similarity& edge : edges) result.emplace(edge.first, edge.second);
  return result;
}

TEST(Relaxing, EqualsRemovingOneEdgeAtATime) {
  for_seeds(2000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    for (const SimilarityEdges& component : connected_components(matching_edges(problem))) {
      const Relaxed relaxed = relax(component, false);
      std::vector<SimilarityEdges> parts;
      SimilarityEdges removed;
      relax_one_by_one(component, parts, removed);
      std::sort(parts.begin(), parts.end(), [](const SimilarityEdges& a, const SimilarityEdges& b) {
        return std::pair(a[0].first, a[0].second) < std::pair(b[0].first, b[0].second);
      });
      EXPECT_EQ(relaxed.parts, parts);
      EXPECT_EQ(positions(relaxed.removed), positions(removed));
    }
  });
}

TEST(Relaxing, NamesTheRemovedEdgesWeakestFirst) {
  const SimilarityEdges cycle{{0, 2, 0.95}, {0, 3, 0.8}, {1, 2, 0.75}, {1, 3, 0.9}};
  const SimilarityEdges expected{{1, 2, 0.75}, {0, 3, 0.8}};
  EXPECT_EQ(relax(cycle, false).removed, expected);
  EXPECT_EQ(relax(cycle, true).removed, expected);
}

TEST(Relaxing, StrictlyAlwaysLeavesTwoEdgesInOnePart) {
  for_seeds(300, [](Random& random) {
    for (const SimilarityEdges& component : connected_components(matching_edges(random_problem(random)))) {
      const Relaxed relaxed = relax(component, true);
      ASSERT_EQ(relaxed.parts.size(), 1u);
      EXPECT_EQ(relaxed.parts[0].size(), std::min<std::size_t>(component.size(), 2));
      EXPECT_EQ(relaxed.parts[0].size() + relaxed.removed.size(), component.size());
    }
  });
}

TEST(Components, AreThoseOfBreadthFirstSearch) {
  for_seeds(500, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    const SimilarityEdges edges = matching_edges(problem);
    std::map<int, int> label;  // spreads the smallest index over the edges until nothing changes
    for (const Similarity& edge : edges) {
      label[edge.first] = edge.first;
      label[edge.second] = edge.second;
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (const Similarity& edge : edges) {
        const int smallest = std::min(label[edge.first], label[edge.second]);
        changed = changed || label[edge.first] != smallest || label[edge.second] != smallest;
        label[edge.first] = label[edge.second] = smallest;
      }
    }
    std::map<int, SimilarityEdges> expected;
    for (const Similarity& edge : edges) expected[label[edge.first]].push_back(edge);
    const auto components = connected_components(edges);
    ASSERT_EQ(components.size(), expected.size());
    std::size_t next = 0;
    for (const auto& [smallest, members] : expected) EXPECT_EQ(components[next++], members);
  });
}

TEST(Reindexing, ConservesCountsButForTheReportedCredit) {
  for_seeds(1000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    const FusionRules rules = random_rules(random);
    const FusionPlan plan = plan_fusion(problem, rules);
    double after = 0.0;
    double credit = 0.0;
    for (const TransitionGroup& group : plan.groups) {
      after += group.count;
      credit += group.credit;
    }
    EXPECT_EQ(after - credit, total(problem.transitions));
    EXPECT_TRUE(rules.split_credit || credit == 0.0);
  });
}

TEST(Reindexing, CreditsTheTransitionBetweenThePartsOfEverySplit) {
  for_seeds(1000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    FusionRules rules = random_rules(random);
    rules.split_credit = true;
    const FusionPlan plan = plan_fusion(problem, rules);
    std::map<std::pair<int, int>, double> expected;
    for (const PrimitiveSplit& split : plan.splits) {
      double came = 0.0;
      double left = 0.0;
      for (const TransitionCount& edge : problem.transitions) {
        if (edge.to == split.primitive && edge.from != split.primitive) came += edge.count;
        if (edge.from == split.primitive && edge.to != split.primitive) left += edge.count;
      }
      expected[{split.first, split.second}] += std::max(came, left);
    }
    for (const TransitionGroup& group : plan.groups) EXPECT_EQ(group.credit, (expected[{group.from, group.to}]));
  });
}

TEST(Reindexing, SizeFollowsTheFormulaAndNeverExceedsThatOfAccumulating) {
  for_seeds(1000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    const FusionPlan plan = plan_fusion(problem, random_rules(random));
    int expected = problem.primitives();
    for (const FusionComponent& component : plan.components) {
      for (const FusionDecision& decision : component.decisions) {
        const bool one = decision.reason == FusionReason::one_to_one || decision.reason == FusionReason::case_1 ||
                         decision.reason == FusionReason::case_3_stronger;
        expected -= one ? 1 : decision.reason == FusionReason::case_2 ? 2 : 0;
      }
    }
    EXPECT_EQ(static_cast<int>(plan.kept.size()), expected);
    EXPECT_LE(plan.groups.size(), problem.transitions.size());
    EXPECT_LE(plan.model_size(), static_cast<std::size_t>(problem.primitives()) + problem.transitions.size());
  });
}

TEST(Reindexing, LeadsEveryTransitionToKeptPrimitivesAndUsesEachOnce) {
  for_seeds(1000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    const FusionPlan plan = plan_fusion(problem, random_rules(random));
    const std::set<int> kept(plan.kept.begin(), plan.kept.end());
    std::set<std::pair<int, int>> sources;
    for (const TransitionGroup& group : plan.groups) {
      EXPECT_TRUE(kept.count(group.from) == 1 && kept.count(group.to) == 1);
      sources.insert(group.sources.begin(), group.sources.end());
    }
    EXPECT_EQ(sources.size(), problem.transitions.size());
    for (std::size_t p = 0; p < plan.in.size(); ++p)
      EXPECT_TRUE(kept.count(plan.in[p]) == 1 && kept.count(plan.out[p]) == 1);
  });
}

TEST(Reindexing, MakesNoSelfTransitionThatWasNone) {
  for_seeds(1000, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    // With all rules as documented, only fused primitives could become one; case 1 takes precedence if they are joined.
    for (const TransitionGroup& group : plan_fusion(problem).groups) {
      const bool any_self =
          std::any_of(group.sources.begin(), group.sources.end(), [](auto edge) { return edge.first == edge.second; });
      EXPECT_TRUE(group.from != group.to || any_self) << group.from;
    }
  });
}

TEST(Reindexing, DoesNotDependOnTheOrderOfTheLists) {
  for_seeds(500, [](Random& random) {
    const FusionProblem problem = random_problem(random);
    FusionProblem shuffled = problem;
    std::shuffle(shuffled.similarities.begin(), shuffled.similarities.end(), random);
    std::shuffle(shuffled.transitions.begin(), shuffled.transitions.end(), random);
    const FusionRules rules = random_rules(random);
    const FusionPlan a = plan_fusion(problem, rules);
    const FusionPlan b = plan_fusion(shuffled, rules);
    EXPECT_EQ(a.in, b.in);
    EXPECT_EQ(a.out, b.out);
    EXPECT_EQ(a.fusion_set, b.fusion_set);
    EXPECT_EQ(a.splits, b.splits);
    EXPECT_EQ(a.kept, b.kept);
    ASSERT_EQ(a.groups.size(), b.groups.size());
    for (std::size_t g = 0; g < a.groups.size(); ++g) {
      EXPECT_EQ(a.groups[g].count, b.groups[g].count);
      EXPECT_EQ(a.groups[g].sources, b.groups[g].sources);
    }
  });
}

TEST(Reindexing, OfAThresholdThatNothingReachesIsTheIdentity) {
  for_seeds(200, [](Random& random) {
    FusionProblem problem = random_problem(random);
    problem.similarity_threshold = 1.1;
    const FusionPlan plan = plan_fusion(problem, random_rules(random));
    std::vector<int> identity(static_cast<std::size_t>(problem.primitives()));
    std::iota(identity.begin(), identity.end(), 0);
    EXPECT_EQ(plan.in, identity);
    EXPECT_EQ(plan.out, identity);
    EXPECT_EQ(plan.kept, identity);
    EXPECT_EQ(plan.groups.size(), problem.transitions.size());
    EXPECT_TRUE(plan.components.empty());
  });
}

TEST(Reindexing, RejectsAThresholdThatIsNotPositive) {
  for (const double threshold : {0.0, -0.5, std::numeric_limits<double>::quiet_NaN()}) {
    FusionProblem problem;
    problem.similarity_threshold = threshold;
    EXPECT_THROW(plan_fusion(problem), std::invalid_argument) << threshold;
  }
}

}  // namespace
}  // namespace sila
