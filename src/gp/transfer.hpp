#pragma once

#include "sila/gp/sparse_gp.hpp"
#include "statistics.hpp"

namespace sila {

/// Adds to `into` the statistics of `from`, without the data behind them; `from` may have other pseudo-inputs, another
/// kernel and another constant mean. The order of transfers does not matter. When pseudo-inputs, kernel and jitter are
/// the same, the statistics are added unchanged (exact); pseudo-inputs common to both are one variable, jitter
/// included, so that nothing is lost when `into` has all those of `from`. The variance that the new pseudo-inputs
/// cannot explain counts as noise, as in FITC. Throws: std::invalid_argument for different D or P. Source: docs/gp.md,
/// section 7. Differs: common pseudo-inputs, see docs/decisions/0011; Cholesky for the eigen-decomposition.
SparseGp transfer(const SparseGp& from, const SparseGp& into);

namespace detail {

/// The statistics that `transfer` adds. Shapes: lower = L_u of `into`, which gives kernel, pseudo-inputs, mean and
/// jitter; its own statistics are not used.
Statistics project(const SparseGp& from, const SparseGp& into, const Eigen::MatrixXd& lower);

/// True if the statistics of the two can be added unchanged.
bool same_basis(const SparseGp& a, const SparseGp& b);

}  // namespace detail

}  // namespace sila
