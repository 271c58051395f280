#pragma once

#include <span>

#include "sila/model/model.hpp"

namespace sila {

/// The model as if everything had been seen only `share` times as often at these sites: transition counts, what flow
/// fields, residual GPs and global residual GPs know, and error statistics. Of what several sites made (shared
/// transitions, the global residual GP of all) the part of these sites fades. Where people were expected stays, how
/// firmly fades. A share of 1 changes nothing. Throws: std::invalid_argument if share is outside (0, 1]. Source: none
/// in the paper; docs/decisions/0049-half-life.md.
Model fade(Model model, double share, std::span<const int> sites);

}  // namespace sila
