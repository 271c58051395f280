#pragma once

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// A sparse GP of the data about their mean; the outputs share theta and Z. With fewer points than
/// config.min_points_to_optimise, Z is chosen greedily and theta kept.
/// Shapes: 0 points: mean zero; 0 or 1 points: no pseudo-inputs, the constant mean with the prior's variance.
/// Throws: std::invalid_argument for wrong shapes, NaN or a field out of range; NumericalError.
/// Source: docs/gp.md, section 6.
SparseGp fit_sparse_gp(const GpData& data, const Hyperparameters& start, const GpConfig& config = {});

}  // namespace sila
