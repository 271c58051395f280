#pragma once

#include <span>
#include <utility>
#include <vector>

#include "sila/fuse/fuse.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Tolerance when a similarity is compared with a threshold, so that exact copies match at a threshold of 1 despite
/// rounding.
inline constexpr double kSimilaritySlack = 1e-9;

/// Edges of the similarity graph, sorted by (first, second).
using SimilarityEdges = std::vector<Similarity>;
SimilarityEdges sorted(SimilarityEdges edges);

/// The edges of the similarity graph G_s: pairs of a previous and an incoming primitive that reach the threshold.
/// Source: SILA paper, Eq. 1 and 2. Differs: "greater than" of the text is read as the ">=" of the equation, with
/// kSimilaritySlack.
SimilarityEdges matching_edges(const FusionProblem& problem);

/// The connected components that have an edge, in the order of their smallest primitive.
std::vector<SimilarityEdges> connected_components(const SimilarityEdges& edges);

/// A component after relaxing.
struct Relaxed {
  std::vector<SimilarityEdges> parts;  ///< of one or two edges each
  SimilarityEdges removed;             ///< weakest first
};

/// Removes the weakest edge (ties: largest previous index, then largest incoming index) from every component of three
/// or more edges and finds the components of the remaining edges, until none has more than two. `strict` removes the
/// weakest edges until two are left, connected or not. Source: SILA paper, Alg. 1, Relaxedges. Differs:
/// docs/decisions/0040.
Relaxed relax(const SimilarityEdges& component, bool strict);

/// The transitions that carry the tracks through a split primitive: those that enter it or, if their count is larger,
/// those that leave it.
std::vector<std::size_t> flow_through(int primitive, const std::vector<TransitionCount>& transitions);

/// Cosine of two primitives: the sum over common cells of the product of their arrows, over the lengths of both
/// primitives. In [-1, 1]; below 0 for opposite directions; 0 if one of them has no length. Scaling a primitive does
/// not change it. Source: SILA paper, Eq. 1.
double similarity(const MotionPrimitive& a, const MotionPrimitive& b);

/// The primitive of a joint index.
const MotionPrimitive& primitive_at(const Model& previous, const Model& incoming, int joint);

/// The similarity graph G_s between the primitives of two models: all pairs of a previous and an incoming primitive
/// with S >= threshold - kSimilaritySlack, in joint indices. Primitives that share no cell are never compared. Throws:
/// std::invalid_argument if the threshold is not positive. Source: SILA paper, Eq. 2.
SimilarityEdges similarity_graph(const Model& previous, const Model& incoming, double threshold);

/// Removes the edges between primitives that have no site in common. A primitive without transitions belongs to all
/// sites of its model.
void keep_sites_apart(SimilarityEdges& graph, const Model& previous, const Model& incoming);

/// The similarities that case 2 needs: of two primitives of one model with a common neighbour in the graph. Joint
/// indices, sorted.
SimilarityEdges leaf_similarities(const SimilarityEdges& graph, const Model& previous, const Model& incoming);

/// The mean of primitives that are fused, cell by cell; weights add. Arrows shorter than FuseConfig::drop_below are
/// dropped, but the longest stays, so that no primitive is left empty. Throws: std::invalid_argument without members,
/// or if they cancel out in every cell. Source: SILA paper, Alg. 2, "average". Differs: docs/decisions/0044.
MotionPrimitive mean_primitive(std::span<const MotionPrimitive* const> members, PrimitiveMean mean);

/// A transition that becomes one with others, and its samples; null: they are gone.
struct FieldSource {
  const Transition* transition;
  const GpData* samples = nullptr;
};

/// The flow field of all sources. A single source is copied bit for bit. Samples replace the GPs that were trained on
/// them, so no data counts twice. Source: SILA paper, Alg. 2, FuseGP; docs/method.md, Fusion.
/// Differs: docs/decisions/0045.
FlowField fuse_fields(std::span<const FieldSource> sources, const GpConfig& config);

/// The model and the index of a transition, by its (from, to) in joint indices. Precondition: one of the models has it.
std::pair<const Model*, std::size_t> source_of(std::pair<int, int> edge, const Model& previous, const Model& incoming);

/// The sources of a group of transitions.
std::vector<FieldSource> sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming);

}  // namespace sila
