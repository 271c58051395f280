#pragma once

#include "sila/model/model.hpp"

namespace sila {

/// The model as if everything had been seen only `share` times as often: transition counts, what flow fields, outlooks
/// and the gait know, and lessons. Where people were expected stays, how firmly fades. A share of 1 changes nothing.
/// Throws: std::invalid_argument if share is outside (0, 1]. Source: none in the paper;
/// docs/decisions/0049-half-life.md.
Model fade(Model model, double share);

}  // namespace sila
