#pragma once

#include <vector>

#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// Splits a mode into itself and up to `room` lighter ones beside it: slower, faster, more to the left, more to the
/// right, each `alternative_reach` standard deviations off. The mixture keeps the mode's mean and covariance along and
/// across the way, so that nothing is claimed that the errors have not shown; only whoever looks at single paths sees
/// more of what may happen. In pairs; none if there is no room for two. `start_m` is where the person is. Source: none
/// in the paper; docs/decisions/0072-alternatives.md.
std::vector<Mode> with_alternatives(const Mode& mode, const Vector2& start_m, int room, const PredictConfig& config);

}  // namespace sila
