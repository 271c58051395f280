#include <algorithm>
#include <map>
#include <tuple>

#include "core/indices.hpp"
#include "fuse/steps.hpp"
#include "sila/fuse/fuse.hpp"

namespace sila {
namespace {

using Pair = std::pair<int, int>;

/// The total order of relaxing: the last edge is removed first.
bool stronger(const Similarity& a, const Similarity& b) {
  return std::tuple(-a.value, a.first, a.second) < std::tuple(-b.value, b.first, b.second);
}

/// Disjoint sets (union-find) of the primitives that some edges touch.
class PrimitiveSets {
 public:
  explicit PrimitiveSets(const SimilarityEdges& edges) {
    int last = -1;
    for (const Similarity& edge : edges) last = std::max({last, edge.first, edge.second});
    parent_ = indices(static_cast<std::size_t>(last + 1));
  }

  std::size_t size() const { return parent_.size(); }

  /// The set of a primitive: its smallest member.
  std::size_t of(int primitive) {
    auto set = static_cast<std::size_t>(primitive);
    while (parent_[set] != set) set = parent_[set] = parent_[parent_[set]];
    return set;
  }

  std::size_t join(std::size_t a, std::size_t b) { return parent_[std::max(a, b)] = std::min(a, b); }

 private:
  std::vector<std::size_t> parent_;
};

/// The numbers of a sparse table of pairs; a pair that is not in it has 0.
using PairTable = std::map<Pair, double>;

double lookup(const PairTable& table, int a, int b) {
  const auto entry = table.find({a, b});
  return entry == table.end() ? 0.0 : entry->second;
}

/// S(a, b), a < b, and T(a, b) of a problem.
struct Tables {
  PairTable similarity;
  PairTable transitions;
};

Tables tables_of(const FusionProblem& problem) {
  Tables tables;
  for (const Similarity& pair : problem.similarities) tables.similarity[{pair.first, pair.second}] = pair.value;
  for (const TransitionCount& edge : problem.transitions) tables.transitions[{edge.from, edge.to}] = edge.count;
  return tables;
}

Relaxed relax_strictly(SimilarityEdges component) {
  std::sort(component.begin(), component.end(), stronger);
  const auto weakest = component.begin() + 2;
  Relaxed result{{sorted({component.begin(), weakest})}, {weakest, component.end()}};
  std::reverse(result.removed.begin(), result.removed.end());
  return result;
}

/// Two edges with a common primitive.
struct Star {
  int centre = 0;
  int leaf_1 = 0;  ///< below leaf_2, of the same model
  int leaf_2 = 0;
};

/// Case 1: the two leaves replace the centre, if a transition leads from one to the other; otherwise nullopt.
std::optional<PrimitiveSplit> split_of(const Star& star, const Tables& tables, const FusionRules& rules) {
  const double forward = lookup(tables.transitions, star.leaf_1, star.leaf_2);
  const double backward = rules.both_directions ? lookup(tables.transitions, star.leaf_2, star.leaf_1) : 0.0;
  if (forward <= 0.0 && backward <= 0.0) return std::nullopt;
  if (forward >= backward) return PrimitiveSplit{star.centre, star.leaf_1, star.leaf_2};
  return PrimitiveSplit{star.centre, star.leaf_2, star.leaf_1};
}

/// Cases 1, 2 and 3 of Alg. 1, in this order.
FusionDecision decide_star(const Star& star, const SimilarityEdges& edges, double threshold, const Tables& tables,
                           const FusionRules& rules) {
  const double similarity = lookup(tables.similarity, star.leaf_1, star.leaf_2);
  if (const auto split = split_of(star, tables, rules)) return {FusionReason::case_1, edges, similarity, {}, split};
  if (similarity >= threshold - kSimilaritySlack) {
    std::vector<int> fused{star.centre, star.leaf_1, star.leaf_2};
    std::sort(fused.begin(), fused.end());
    return {FusionReason::case_2, edges, similarity, fused, std::nullopt};
  }
  if (!rules.case_3_fuses_stronger) return {FusionReason::case_3, edges, similarity, {}, std::nullopt};
  const Similarity& best = stronger(edges[0], edges[1]) ? edges[0] : edges[1];
  return {FusionReason::case_3_stronger, edges, similarity, {best.first, best.second}, std::nullopt};
}

/// The decision on a part of one or two edges. It depends on this part alone, so the order of the parts does not
/// matter.
FusionDecision decide(const SimilarityEdges& edges, double threshold, const Tables& tables, const FusionRules& rules) {
  if (edges.size() == 1) return {FusionReason::one_to_one, edges, 0.0, {edges[0].first, edges[0].second}, std::nullopt};
  const auto& [a, b] = std::pair(edges[0], edges[1]);
  // The graph is bipartite and edges are sorted: the common primitive is either the previous or the incoming one of
  // both.
  if (a.first == b.first) return decide_star({a.first, a.second, b.second}, edges, threshold, tables, rules);
  if (a.second == b.second) return decide_star({a.second, a.first, b.first}, edges, threshold, tables, rules);
  return {FusionReason::apart, edges, 0.0, {}, std::nullopt};
}

FusionComponent resolve(const SimilarityEdges& component, double threshold, const Tables& tables,
                        const FusionRules& rules) {
  Relaxed relaxed = relax(component, rules.strict_relax);
  FusionComponent resolved{std::move(relaxed.removed), {}};
  for (const SimilarityEdges& part : relaxed.parts)
    resolved.decisions.push_back(decide(part, threshold, tables, rules));
  return resolved;
}

/// in, out, fusion set and splits: the decisions, applied to m_in = m_out = m.
FusionPlan reindex(int primitives, std::vector<FusionComponent> components) {
  FusionPlan plan;
  plan.in = plan.out = indices<int>(static_cast<std::size_t>(primitives));
  for (const FusionComponent& component : components) {
    for (const FusionDecision& decision : component.decisions) {
      for (const int member : decision.fused)
        plan.in[static_cast<std::size_t>(member)] = plan.out[static_cast<std::size_t>(member)] = decision.fused.front();
      if (!decision.fused.empty()) plan.fusion_set.push_back(decision.fused);
      if (!decision.split) continue;
      plan.in[static_cast<std::size_t>(decision.split->primitive)] = decision.split->first;
      plan.out[static_cast<std::size_t>(decision.split->primitive)] = decision.split->second;
      plan.splits.push_back(*decision.split);
    }
  }
  std::ranges::sort(plan.fusion_set);
  std::ranges::sort(plan.splits, {}, &PrimitiveSplit::primitive);
  plan.components = std::move(components);
  return plan;
}

/// The primitives that keep their index: in = out = their own.
std::vector<int> kept_primitives(const FusionPlan& plan) {
  std::vector<int> kept;
  for (std::size_t p = 0; p < plan.in.size(); ++p) {
    const int primitive = static_cast<int>(p);
    if (plan.in[p] == primitive && plan.out[p] == primitive) kept.push_back(primitive);
  }
  return kept;
}

/// From and to of a transition after the re-indexing.
Pair mapped(const TransitionCount& edge, const FusionPlan& plan, const FusionRules& rules) {
  const std::size_t from = static_cast<std::size_t>(edge.from);
  // A pedestrian who stays in a split primitive walks from its first part to its second, not back.
  if (edge.from == edge.to && !rules.literal_self_transitions) return {plan.in[from], plan.out[from]};
  return {plan.out[from], plan.in[static_cast<std::size_t>(edge.to)]};
}

std::vector<TransitionGroup> group_transitions(const FusionProblem& problem, const FusionPlan& plan,
                                               const FusionRules& rules) {
  std::vector<TransitionCount> transitions = problem.transitions;
  std::ranges::sort(transitions, {}, [](const TransitionCount& edge) { return Pair(edge.from, edge.to); });
  std::map<Pair, TransitionGroup> groups;
  for (const TransitionCount& edge : transitions) {
    const Pair target = mapped(edge, plan, rules);
    TransitionGroup& group =
        groups.try_emplace(target, TransitionGroup{target.first, target.second, 0, 0, {}}).first->second;
    group.count += edge.count;
    group.sources.emplace_back(edge.from, edge.to);
  }
  for (const PrimitiveSplit& split : plan.splits) {
    if (!rules.split_credit) break;
    TransitionGroup& between = groups.at({split.first, split.second});  // case 1 requires this transition
    for (const std::size_t t : flow_through(split.primitive, problem.transitions)) {
      between.credit += problem.transitions[t].count;
      between.count += problem.transitions[t].count;
    }
  }
  std::vector<TransitionGroup> result;
  for (auto& [target, group] : groups) result.push_back(std::move(group));
  return result;
}

}  // namespace

std::vector<std::size_t> flow_through(int primitive, const std::vector<TransitionCount>& transitions) {
  std::vector<std::size_t> entering, leaving;
  double sum = 0.0;  // entering minus leaving
  for (std::size_t t = 0; t < transitions.size(); ++t) {
    const auto& [from, to, count] = transitions[t];
    if (from == to) continue;
    if (to == primitive) {
      entering.push_back(t);
      sum += count;
    }
    if (from == primitive) {
      leaving.push_back(t);
      sum -= count;
    }
  }
  return sum >= 0.0 ? entering : leaving;
}

SimilarityEdges matching_edges(const FusionProblem& problem) {
  SimilarityEdges edges;
  for (const Similarity& pair : problem.similarities) {
    const bool between_models = pair.first < problem.previous_primitives && pair.second >= problem.previous_primitives;
    if (between_models && pair.value >= problem.similarity_threshold - kSimilaritySlack) edges.push_back(pair);
  }
  return sorted(std::move(edges));
}

std::vector<SimilarityEdges> connected_components(const SimilarityEdges& edges) {
  PrimitiveSets sets(edges);
  for (const Similarity& edge : edges) sets.join(sets.of(edge.first), sets.of(edge.second));
  std::map<std::size_t, SimilarityEdges> components;
  for (const Similarity& edge : edges) components[sets.of(edge.first)].push_back(edge);
  std::vector<SimilarityEdges> result;
  for (auto& [set, members] : components) result.push_back(sorted(std::move(members)));
  return result;
}

// To remove the weakest edge until each part has at most two edges gives the same parts as to add edges, strongest
// first, and to close a part as soon as an edge would give it a third: such an edge is removed, and the closed part
// takes no more edges. So one pass over the sorted edges is enough.
Relaxed relax(const SimilarityEdges& component, bool strict) {
  if (component.size() <= 2) return {{component}, {}};
  if (strict) return relax_strictly(component);
  SimilarityEdges edges = component;
  std::sort(edges.begin(), edges.end(), stronger);
  PrimitiveSets sets(edges);
  std::vector<std::size_t> count(sets.size(), 0);
  std::vector<bool> closed(sets.size(), false);
  Relaxed result;
  SimilarityEdges left;
  for (const Similarity& edge : edges) {
    const std::size_t a = sets.of(edge.first);
    const std::size_t b = sets.of(edge.second);
    const std::size_t together = 1 + count[a] + (a == b ? 0 : count[b]);
    if (closed[a] || closed[b] || together > 2) {
      closed[a] = closed[b] = true;
      result.removed.push_back(edge);
    } else {
      count[sets.join(a, b)] = together;
      left.push_back(edge);
    }
  }
  std::reverse(result.removed.begin(), result.removed.end());
  result.parts = connected_components(left);
  return result;
}

FusionPlan plan_fusion(const FusionProblem& problem, const FusionRules& rules) {
  validate(problem);
  const Tables tables = tables_of(problem);
  std::vector<FusionComponent> components;
  for (const SimilarityEdges& component : connected_components(matching_edges(problem)))
    components.push_back(resolve(component, problem.similarity_threshold, tables, rules));
  FusionPlan plan = reindex(problem.primitives(), std::move(components));
  plan.kept = kept_primitives(plan);
  plan.groups = group_transitions(problem, plan, rules);
  return plan;
}

}  // namespace sila
