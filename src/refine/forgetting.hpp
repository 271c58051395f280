#pragma once

#include <span>

#include "sila/model/model.hpp"

namespace sila {

/// Exponential forgetting: multiplies by `factor` how often everything was observed at these sites: transition counts,
/// the data of flow fields, residual GPs and global residual GPs, and error statistics. Of data that several sites
/// share (shared transitions, the global residual GP of all) the part of these sites is discounted. Means stay,
/// certainty falls. A factor of 1 changes nothing. Throws: std::invalid_argument if factor is outside (0, 1]. Source:
/// none in the paper; docs/decisions/0049-half-life.md.
Model discount_model(Model model, double factor, std::span<const int> sites);

}  // namespace sila
