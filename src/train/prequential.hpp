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

/// At sites that the model does not know the batch is split into parts, and a model of the earlier parts predicts each.
/// `predictor`: of `previous`, null if there is none yet. Source: docs/method.md, section 2.2.
BatchErrors recent_errors(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                          const Predictor* predictor);

}  // namespace sila
