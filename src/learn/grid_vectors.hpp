#pragma once

#include <span>
#include <vector>

#include "sila/core/grid.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// A trajectory on the grid, tr_i of the paper: the unit velocity in each cell that it visits.
struct GridVector {
  std::vector<CellKey> path;        ///< visited cells in the order of the first visit, each once
  std::vector<Vector2> directions;  ///< unit velocity of each; zero where the person turned about (inactive)
};

/// Maps trajectories to the grid. Samples below `min_speed_mps` have no heading and are skipped; a cell crossed between
/// two samples is found by linear sub-samples; a cell whose headings cancel (mean below 0.3) stays inactive. Source:
/// SILA paper, section on ASNSC ("k-th entry is the normalised velocity in cell k"); docs/learn.md, section 1.
GridVector to_grid_vector(const CurbTrajectory& track, const Grid& grid, double min_speed_mps);

}  // namespace sila
