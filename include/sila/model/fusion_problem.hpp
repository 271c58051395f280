#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace sila {

// Joint indices number the primitives of both models: those of the previous model are 0 .. previous_primitives - 1,
// those of the incoming model follow.

/// The similarity S of two primitives, first < second (joint indices).
struct Similarity {
  int first = 0;
  int second = 0;
  double value = 0.0;
  bool operator==(const Similarity&) const = default;
};

/// Number of tracks that showed the transition from -> to, T(from, to) (joint indices, both of the same model).
struct TransitionCount {
  int from = 0;
  int to = 0;
  double count = 0.0;
  bool operator==(const TransitionCount&) const = default;
};

/// The input of the re-indexing of SILA: indices, similarities and counts, no vectors and no GPs.
/// Invariant: `validate(problem)` passes.
struct FusionProblem {
  double similarity_threshold = 0.7;     ///< t_s
  int previous_primitives = 0;           ///< N1
  int incoming_primitives = 0;           ///< N1'
  std::vector<Similarity> similarities;  ///< between the models and within them; a pair that is not listed has S = 0
  std::vector<TransitionCount> transitions;  ///< R and shifted R'

  int primitives() const { return previous_primitives + incoming_primitives; }
};

/// Choices where the paper is silent or contradicts itself (docs/fuse.md).
struct FusionRules {
  bool strict_relax = false;    ///< Alg. 1 literally: keep two edges of a big component, even if they do not touch
  bool both_directions = true;  ///< case 1 looks for a transition between the leaves in both directions
  bool split_credit = false;    ///< tracks through a split primitive are added to the count between its parts
  /// A self transition of a split primitive becomes second -> first, as Alg. 2 literally says.
  bool literal_self_transitions = false;
  bool case_3_fuses_stronger = false;  ///< case 3 fuses the stronger of the two pairs instead of nothing
};

/// The decision on the primitives of one component of the similarity graph, or of a part of it after relaxing.
enum class FusionReason {
  one_to_one,       ///< one edge: the two are fused
  case_1,           ///< the centre is replaced by its two leaves, one after the other
  case_2,           ///< centre and leaves are fused
  case_3,           ///< nothing
  case_3_stronger,  ///< the stronger pair is fused, by option
  apart,            ///< two edges that share no primitive, left by strict_relax: nothing
};

/// A primitive that was replaced by two others, one after the other.
struct PrimitiveSplit {
  int primitive = 0;
  int first = 0;
  int second = 0;
  bool operator==(const PrimitiveSplit&) const = default;
};

/// One decision. Edges are sorted; `leaf_similarity` is S of the two leaves, 0 unless there are two edges with a
/// centre.
struct FusionDecision {
  FusionReason reason = FusionReason::one_to_one;
  std::vector<Similarity> edges;
  double leaf_similarity = 0.0;
  std::vector<int> fused;               ///< sorted; empty if nothing is fused
  std::optional<PrimitiveSplit> split;  ///< of case 1
};

/// A connected component of the similarity graph: the edges that relaxing removed, weakest first, and a decision on
/// each part that remains.
struct FusionComponent {
  std::vector<Similarity> relaxed;
  std::vector<FusionDecision> decisions;
};

/// A transition of the fused model and the transitions that become it (joint indices, as they were before fusing).
struct TransitionGroup {
  int from = 0;
  int to = 0;
  double count = 0.0;                        ///< the sum over the sources, and the credit
  double credit = 0.0;                       ///< split credit in `count`
  std::vector<std::pair<int, int>> sources;  ///< sorted
};

/// How two models become one, in joint indices. Everything is sorted, so equal problems give equal plans.
struct FusionPlan {
  std::vector<int> in;                       ///< for each primitive: where transitions to it end after the fusion
  std::vector<int> out;                      ///< for each primitive: where transitions from it begin
  std::vector<std::vector<int>> fusion_set;  ///< the primitives of each tuple are averaged into its first
  std::vector<PrimitiveSplit> splits;
  std::vector<int> kept;  ///< primitives of the fused model, in their order there
  std::vector<TransitionGroup> groups;
  std::vector<FusionComponent> components;  ///< the decisions that led to the plan

  /// The paper's model size: |D''| + |R''|.
  std::size_t model_size() const { return kept.size() + groups.size(); }
};

/// Throws std::invalid_argument "fusion problem: ..." for counts below zero, pairs out of range, listed twice or out of
/// order (first < second), transitions between the models, listed twice or with a count that is not positive, a
/// threshold that is not positive.
void validate(const FusionProblem& problem);

/// "one-to-one", "case 1", "case 2", "case 3", "case 3, stronger pair", "apart".
const char* describe(FusionReason reason);

}  // namespace sila
