#pragma once

#include <vector>

#include "sila/model/fusion_problem.hpp"

namespace sila {

/// Tolerance when a similarity is compared with a threshold, so that exact copies match at a threshold of 1 despite
/// rounding.
inline constexpr double kSimilaritySlack = 1e-9;

/// Edges of the similarity graph, sorted by (first, second).
using SimilarityEdges = std::vector<Similarity>;

/// The edges of the similarity graph G_s: pairs of a previous and an incoming primitive that reach the threshold.
/// Source: SILA paper, Eq. 1 and 2. Differs: "greater than" of the text is read as the ">=" of the equation, with
/// kSimilaritySlack.
SimilarityEdges matching_edges(const FusionProblem& problem);

/// The connected components that have an edge, in the order of their smallest primitive.
std::vector<SimilarityEdges> connected_components(const SimilarityEdges& edges);

/// What relaxing leaves of a component.
struct Relaxed {
  std::vector<SimilarityEdges> parts;  ///< of one or two edges each
  SimilarityEdges removed;             ///< weakest first
};

/// Removes the weakest edge (ties: largest previous index, then largest incoming index) from every component of three
/// or more edges and finds the components of the remaining edges, until none has more than two. `strict` removes the
/// weakest edges until two are left, connected or not. Source: SILA paper, Alg. 1, Relaxedges. Differs:
/// docs/decisions/0040.
Relaxed relax(const SimilarityEdges& component, bool strict);

}  // namespace sila
