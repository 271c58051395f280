#pragma once

#include <span>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// The errors of a batch, predicted before it is learnt.
struct BatchErrors {
  std::vector<Site> sites;  ///< with error statistics
  PrequentialError path;    ///< at all sites that the model knew
};

/// The errors of `previous` on a batch that it has not learnt. At sites that it does not know, the batch is split into
/// parts, and a model of the earlier parts predicts each. `predictor`: that of `previous`; null: it is made here.
/// Source: docs/method.md, section 2.2.
BatchErrors recent_errors(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                          const Predictor* predictor);

}  // namespace sila
