#pragma once

#include <span>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// Modified Hausdorff distance: the larger of the two mean nearest distances [m].
/// Throws: std::invalid_argument if a path is empty.
/// Source: Dubuisson & Jain 1994. It ignores order and time: a reversed path scores 0.
double modified_hausdorff_m(std::span<const Vector2> a, std::span<const Vector2> b);

}  // namespace sila
