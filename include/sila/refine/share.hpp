#pragma once

#include "sila/model/model.hpp"

namespace sila {

/// What of a model may be given away: the transitions that at least so many different tracks showed, between primitives
/// of which that holds as well. All else is gone, without a trace in the rest but for what sums over all tracks keep
/// (error statistics and global residual GP; docs/privacy.md). May be empty.
/// Throws: std::invalid_argument if min_people is below 1.
Model shareable(Model model, int min_people);

}  // namespace sila
