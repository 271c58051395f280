#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "learn/grid_vectors.hpp"
#include "sila/learn/learn.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The nearest point (in the Euclidean norm) of the cone that keeps a primitive's arrow no longer than its activeness,
/// and the activeness at most 1: |(x, y)| <= b / g, b <= g. `g` is the square root of the activeness weight. Source:
/// docs/learn.md, section 4. It is what forbids pairs of primitives of opposite sign.
Eigen::Vector3d project_arrow(const Eigen::Vector3d& arrow, double g);

/// One use of a primitive by a track.
struct Coefficient {
  int primitive = 0;
  double value = 0.0;  ///< > 0
};

/// What dictionary learning found.
struct Dictionary {
  std::vector<MotionPrimitive> primitives;
  std::vector<std::vector<Coefficient>> codes;  ///< per track, sorted by primitive
  std::vector<double> objective;                ///< after every step, with the price of each primitive: never increases
};

/// Learns local motion primitives by augmented semi-nonnegative sparse coding:
/// min 1/2 |X - D S|^2 + sparsity * sum S, S >= 0, each primitive in its convex set and support; primitives are added
/// while each pays `gain` (cell visits). Source: Chen, Liu, How 2016 (ASNSC); docs/learn.md, sections 2 to 5. Differs:
/// support masks, see docs/decisions/0002-support-masks.md.
Dictionary learn_dictionary(std::span<const GridVector> tracks, const Grid& grid, double gain_cells, double run_cells,
                            const DictionaryConfig& config);

}  // namespace sila
