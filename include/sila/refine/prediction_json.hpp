#pragma once

#include <string>

#include "sila/refine/explanation.hpp"

namespace sila {

/// A prediction as one line of JSON without the line's end (docs/formats.md): seconds, metres, world frame; times after
/// t0; covariances as [xx, xy, yy].
std::string prediction_line(const std::string& track, const Prediction& prediction,
                            const Explanation* explanation = nullptr);

}  // namespace sila
