#pragma once

#include <cstddef>

#include "sila/predict/prediction.hpp"

namespace sila {

/// The share of a prediction's mass that lies where its density is higher than at `truth_m`: the truth is inside the
/// smallest region that is stated to hold p of the mass if and only if this is at most p. Over many pedestrians it is
/// uniform on [0, 1] if the stated regions hold what they say. Exact for one mode; for several the mass is summed over
/// fixed points of each mode, to within about 0.01.
/// Throws: std::invalid_argument if there is no mode or a mode is shorter than `step`.
double mass_above(const Prediction& prediction, std::size_t step, const Vector2& truth_m);

}  // namespace sila
