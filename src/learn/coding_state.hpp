#pragma once

// The working state of dictionary learning: sparse in cells, so that its cost grows with what tracks visit and not with the grid.

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include "sila/learn/dictionary.hpp"

namespace sila {

using Arrow = Eigen::Vector3d;  ///< (vx, vy, g * activeness) of one cell

/// A value in one cell; `cell` is a dense index into CodingProblem::cells.
struct CellArrow {
  int cell = 0;
  Arrow value = Arrow::Zero();
};

/// The tracks of a batch on the cells that any of them visits.
struct CodingProblem {
  CodingProblem(std::span<const GridVector> tracks, const Grid& grid, double activeness_weight);

  std::vector<CellKey> cells;                          ///< sorted
  std::vector<std::vector<CellArrow>> tracks;          ///< per track, in path order, active cells only
  std::vector<std::vector<CellArrow>> visits;          ///< per cell; CellArrow::cell is the track here
  Grid grid;
  double g = 1.0;  ///< square root of the activeness weight
  double energy = 0.0;
};

/// Primitives on their support, and the code of each track.
struct CodingState {
  std::vector<std::vector<CellArrow>> primitives;       ///< sorted by cell
  std::vector<std::vector<Coefficient>> codes;          ///< per track, sorted by primitive, value > 0
  double objective = 0.0;                               ///< 1/2 |X - D S|^2 + penalty * sum S, without the price of primitives
};

/// Recomputes all codes for the given primitives (exact minimum); warm-started from the present ones.
CodingState with_new_codes(const CodingProblem& problem, CodingState state, double penalty);

/// Replaces each primitive in turn by the exact minimiser over its convex set (algorithms 1.5).
CodingState with_new_primitives(const CodingProblem& problem, CodingState state);

/// What of each visited cell of a track the code does not explain, in path order.
std::vector<CellArrow> residual(const CodingProblem& problem, const CodingState& state, std::size_t track);

/// How much the objective would rise without a primitive, the other coefficients of the tracks that use it fitted anew.
double removal_cost(const CodingProblem& problem, const CodingState& state, int primitive, double penalty);

/// The state without the primitives for which `drop` is true; codes are fitted anew.
CodingState without(const CodingProblem& problem, const CodingState& state, const std::vector<bool>& drop, double penalty);

}  // namespace sila
