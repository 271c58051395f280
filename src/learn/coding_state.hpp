#pragma once

// The working state of dictionary learning: sparse in cells, so that its cost grows with what tracks visit and not with
// the grid.

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "learn/steps.hpp"

namespace sila {

using Arrow = Eigen::Vector3d;  ///< (vx, vy, activeness) of one cell

/// A value in one cell; `cell` is a dense index into CodingProblem::cells.
struct CellArrow {
  int cell = 0;
  Arrow value = Arrow::Zero();
};

/// The tracks of a batch on the cells that any of them visits.
struct CodingProblem {
  CodingProblem(std::span<const GridVector> tracks, const Grid& grid, double gain_cells);

  std::vector<CellKey> cells;                  ///< sorted
  std::vector<std::vector<CellArrow>> tracks;  ///< per track, in path order, active cells only
  std::vector<std::vector<CellArrow>> visits;  ///< per cell; CellArrow::cell is the track here
  Grid grid;
  double gain_cells;    ///< price of a primitive: the least by which it must lower the objective
  double energy = 0.0;  ///< 1/2 |X|^2, the objective without primitives
};

/// Primitives on their support, and the code of each track.
struct CodingState {
  std::vector<std::vector<CellArrow>> primitives;  ///< sorted by cell
  std::vector<std::vector<Coefficient>> codes;     ///< per track, sorted by primitive, value > 0
  double objective = 0.0;  ///< 1/2 |X - D S|^2 + sparsity * sum S, without the price of primitives
};

/// The state with the optimal code of each track for its primitives (exact minimum); starts from the present codes.
CodingState with_new_codes(const CodingProblem& problem, CodingState state);

/// The state in which each primitive in turn was replaced by the exact minimiser over its convex set (docs/learn.md,
/// section 4). The codes do not change, and `objective` is not updated.
CodingState with_new_primitives(const CodingProblem& problem, CodingState state);

/// The part of each visited cell of a track that the code does not explain, in path order.
std::vector<CellArrow> residual(const CodingProblem& problem, const CodingState& state, std::size_t track);

/// How the primitives of a state overlap; codes are computed from it.
struct Overlap {
  /// A primitive in a cell, and its arrow; points into the state.
  struct Entry {
    int primitive = 0;
    const Arrow* arrow = nullptr;
  };
  std::vector<Entry> entries;      ///< of one cell after another, primitives in order
  std::vector<std::size_t> first;  ///< entry of each cell, and the end
  Eigen::MatrixXd gram;            ///< inner products of the primitives; zero for removed ones

  std::span<const Entry> at(int cell) const {
    const auto c = static_cast<std::size_t>(cell);
    return std::span(entries).subspan(first[c], first[c + 1] - first[c]);
  }
};
Overlap overlap_of(const CodingProblem& problem, const CodingState& state);

/// The effect of removing a primitive: the rise of the objective, and the new codes of the tracks that use it. The
/// codes of other tracks stay optimal without it.
struct Removal {
  double cost = 0.0;
  std::vector<std::pair<std::size_t, std::vector<Coefficient>>> codes;
};
/// `overlap` is that of `state`.
Removal removal_of(const CodingProblem& problem, const CodingState& state, const Overlap& overlap, int primitive);

/// The state without the primitives for which `drop` is true, and without their coefficients. `objective` does not
/// change, so it is right only if no code used them.
CodingState without(const CodingState& state, const std::vector<bool>& drop);

}  // namespace sila
