#pragma once

#include <optional>
#include <span>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Fuses parts, whose data are gone, and new data into one GP. Give the data or the GP fitted to them, never both.
/// Kernel and noise are the points-weighted log mean of the parts' (bit-identical if they agree), the constant mean is
/// the points-weighted mean; pseudo-inputs are chosen greedily from those of the parts and the lattice points near the
/// data. Independent of the order of the parts up to rounding. One part and no data: that part, unchanged.
/// `data_hyperparameters` is the theta of the data's own fit: it joins the weighted mean, and is used alone if no part
/// has a point. Shapes: data may be empty (0 points). Throws: std::invalid_argument if there is neither a part nor
/// data_hyperparameters, or the shapes disagree. Source: docs/gp.md, section 8; config.fusion = pseudo_data: section 9
/// (Suk, Wang, Lee 2012).
SparseGp fuse_gps(std::span<const SparseGp* const> parts, const GpData& data, const GpConfig& config = {},
                  const std::optional<Hyperparameters>& data_hyperparameters = std::nullopt);

/// The same GP on at most `max_pseudo_inputs` of its pseudo-inputs, chosen greedily. Throws: as fuse_gps.
SparseGp reduce_pseudo_inputs(const SparseGp& gp, int max_pseudo_inputs);

}  // namespace sila
