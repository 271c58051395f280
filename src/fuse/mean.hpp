#pragma once

#include <span>

#include "sila/fuse/fuse.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The mean of primitives that are fused, cell by cell; weights add. Arrows shorter than `drop_below` are dropped, but
/// the longest stays, so that no primitive is left empty. Throws: std::invalid_argument without members, or if they
/// cancel out in every cell. Source: SILA paper, Alg. 2, "average". Differs: docs/decisions/0044.
MotionPrimitive mean_primitive(std::span<const MotionPrimitive* const> members, PrimitiveMean mean, double drop_below);

}  // namespace sila
