#pragma once

#include <span>

#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// A sparse GP of the data about their mean, the outputs sharing theta and Z. What is chosen, kept and optimised is the
/// config's; `hyperparameters` = pooled means that the pooled theta is what `start` holds. With fewer points than
/// config.min_points_to_optimise, Z is chosen greedily and theta kept.
/// Shapes: 0 points: mean zero; 0 or 1 points: no pseudo-inputs, the constant mean with the prior's variance.
/// Throws: std::invalid_argument for wrong shapes, NaN or a field out of range; NumericalError.
/// Source: algorithms 2.5, 2.6.
SparseGp fit_sparse_gp(const GpData& data, const Hyperparameters& start, const GpConfig& config = {});

/// One theta for many data sets: the one that maximises the sum of their evidences, each about its own mean, with
/// greedily chosen Z. Sets with fewer than 2 points are left out; if none is left, `start`. Throws: as fit_sparse_gp.
/// Source: algorithms 2.5.
Hyperparameters pool_hyperparameters(std::span<const GpData> sets, const Hyperparameters& start,
                                     const GpConfig& config = {});

}  // namespace sila
