#pragma once

#include <span>

#include "sila/refine/learning_curve.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

struct GatheredErrors {
  ErrorStatistics statistics;
  PrequentialError path;
};

/// The errors of the predictor on these windows. Prequential: the windows must be of tracks that its model has not
/// learnt.
GatheredErrors gather_errors(const Predictor& predictor, std::span<const Window> windows);

/// The error statistics of all sites and the prior together, for an untrained site; `place_free`: without those of what
/// depends on the site.
ErrorStatistics pooled_error_statistics(const Model& model, bool place_free);

/// The error statistics of one site, its nonconformity scores shrunk to those of the others: what these saw is a prior
/// that counts as a few windows (power prior). The rest is the site's own, for regressions and variances of other sites
/// made predictions worse, unless the caller gave them as the prior of the model. A site alone keeps its own bit for
/// bit. Source: none in the paper; docs/decisions/0097-sites.md.
ErrorStatistics shrunk_error_statistics(const Model& model, std::size_t site);

}  // namespace sila
