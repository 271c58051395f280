#pragma once

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Adds to `into` what `from` knows, without the data behind it; `from` may have other pseudo-inputs, another kernel
/// and another constant mean. Order-free: transferring a, then b is transferring b, then a. When pseudo-inputs, kernel
/// and jitter are the same, the statistics are added as they are (exact); pseudo-inputs common to both are one
/// variable, jitter included, so that nothing is lost when `into` has all those of `from`. `alpha` = 1 keeps the
/// variance that the new pseudo-inputs cannot explain (FITC-like), 0 drops it (DTC / VFE). Throws:
/// std::invalid_argument for different D or P, or alpha outside [0, 1]. Source: algorithms 3.3. Differs: common
/// pseudo-inputs, see docs/decisions/0011; Cholesky for the eigen-decomposition.
SparseGp transfer(const SparseGp& from, const SparseGp& into, double alpha = 1.0);

}  // namespace sila
