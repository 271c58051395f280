#pragma once

#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// Whether two frames stand at the same corner: origins within 1 m, axes within about 5 degrees.
bool same_place(const CurbFrame& a, const CurbFrame& b);

bool is_known(const std::vector<CurbFrame>& places, const CurbFrame& frame);

/// `places`, and those of `more` that are not among them, in order.
std::vector<CurbFrame> with_places(std::vector<CurbFrame> places, const std::vector<CurbFrame>& more);

}  // namespace sila
