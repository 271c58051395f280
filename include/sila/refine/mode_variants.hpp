#pragma once

#include <span>

#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// How many lighter modes there are beside the most likely: pairs, as far as there is room.
int count_variants(int room, const PredictConfig& config);

/// Splits the first of the modes into itself and the others, lighter ones beside it: slower, faster, more to the left,
/// more to the right, each `variant_reach` standard deviations off. The mixture keeps the mode's mean and
/// covariance along and across the way, so that nothing is claimed that the errors have not shown; only whoever looks
/// at single paths sees more of what may happen. In pairs; none if there is no room for two. `start_m` is where the
/// person is. Source: none in the paper; docs/decisions/0072-mode_variants.md.
void split_into_variants(std::span<Mode> modes, const Vector2& start_m, const PredictConfig& config);

}  // namespace sila
