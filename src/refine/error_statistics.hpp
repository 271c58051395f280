#pragma once

#include <span>

#include "sila/refine/predictor.hpp"

namespace sila {

/// Error statistics of the predictor on these windows. Prequential: the windows must be of tracks that its model has
/// not learnt.
ErrorStatistics gather_error_statistics(const Predictor& predictor, std::span<const Window> windows);

/// The error statistics of all sites together, for an untrained one; `place_free`: without those of what depends on the
/// site.
ErrorStatistics pooled_error_statistics(const std::vector<Site>& sites, bool place_free);

/// The error statistics of one site and, as a prior, those of all sites (`of_all`), which count as a few windows (power
/// prior). A site alone keeps its own bit for bit. Source: none in the paper; docs/decisions/0097-sites.md.
ErrorStatistics shrunk_error_statistics(const std::vector<Site>& sites, std::size_t site,
                                        const ErrorStatistics& of_all);

}  // namespace sila
