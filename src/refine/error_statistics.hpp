#pragma once

#include <span>

#include "sila/refine/learning_curve.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// The errors of a predictor on some windows: sums for the model, and the displacement errors of mean paths.
struct GatheredErrors {
  ErrorStatistics statistics;
  PrequentialError path;
};

/// The errors of the predictor on these windows of one site. Prequential: the windows must be of tracks that its model
/// has not learnt.
GatheredErrors gather_errors(const Predictor& predictor, std::span<const Window> windows);

/// The sum of the error statistics of all sites and of the prior, for an untrained site: without the sums of
/// predictions that depend on the site.
ErrorStatistics pooled_error_statistics(const Model& model);

/// The error statistics of one site, with nonconformity scores shrunk to those of the other sites, which count as at
/// most 20 windows (power prior), and with the prior of the model added. All other sums are those of the site alone,
/// because regressions and variances of other sites made predictions worse. For a model of one site without prior the
/// result is that of the site, bit for bit. Source: none in the paper; docs/decisions/0097-sites.md, 0127-prior.md.
ErrorStatistics shrunk_error_statistics(const Model& model, std::size_t site);

}  // namespace sila
