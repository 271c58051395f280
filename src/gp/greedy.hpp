#pragma once

#include <Eigen/Core>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Chooses pseudo-inputs from the candidates (pivoted Cholesky): repeatedly the one with the largest conditional
/// variance given those chosen so far, until `max_count` are chosen or the largest conditional variance is below
/// `stop_fraction` of the signal variance. Of candidates equal within 1e-9 the first is taken, so the choice is
/// deterministic. Shapes: candidates D x n; the result is D x M, M <= min(n, max_count). Throws: std::invalid_argument
/// for wrong shapes, NaN, max_count < 0 or stop_fraction outside [0, 1]. Source: docs/gp.md, section 5. Cost O(n M^2).
Eigen::MatrixXd select_pseudo_inputs(const Kernel& kernel, const Eigen::MatrixXd& candidates, int max_count,
                                     double stop_fraction = 0.01);

}  // namespace sila
