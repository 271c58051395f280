#pragma once

#include <span>

#include "sila/model/model.hpp"

namespace sila {

/// A model that knows only how people walked at the places of other models: the sum of their error statistics and of
/// their different priors, without what depends on positions. Learning that begins with it predicts better while few
/// tracks are known.
/// Throws: std::invalid_argument if no model has error statistics, their shapes differ, or two have learnt one episode.
/// Source: none in the paper; power prior (Ibrahim and Chen 2000); docs/decisions/0127-prior.md.
Model make_prior(std::span<const Model> models);

}  // namespace sila
