#pragma once

#include <optional>
#include <span>

#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// One GP that knows what all parts know, whose data are gone, and the new data. Give the data or the GP trained on
/// them, never both. Kernel and noise are the points-weighted log mean of the parts' (bit-identical if they agree), the
/// constant mean is the points-weighted mean; pseudo-inputs are chosen greedily from those of the parts and the data's
/// inputs. Free of the order of parts up to rounding. One part and no data: the part itself, unchanged.
/// `data_hyperparameters` is the theta of the data's own fit: it joins the weighted mean, and stands alone if no part
/// has a point. Shapes: data may be empty (0 points). Throws: std::invalid_argument if there is neither a part nor
/// data_hyperparameters, or the shapes disagree. Source: algorithms 3.3 FuseGP, 3.4; config.fusion = pseudo_data: 3.1,
/// Suk, Wang, Lee 2012 as read there.
SparseGp fuse_gps(std::span<const SparseGp* const> parts, const GpData& data, const GpConfig& config = {},
                  const std::optional<Hyperparameters>& data_hyperparameters = std::nullopt);

/// How well kernel, noise and pseudo-inputs (those of `prior`, a GP that has seen nothing) explain the parts and the
/// data: the logarithm of the streaming evidence summed over the outputs, up to a constant that depends on the parts
/// only. Source: algorithms 3.4 (alpha = 1).
double log_streaming_evidence(std::span<const SparseGp* const> parts, const GpData& data, const SparseGp& prior);

}  // namespace sila
