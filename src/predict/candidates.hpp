#pragma once

#include <span>

#include "predict/flow_field_index.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// A transition that the person may be in.
struct Candidate {
  int transition = 0;
  double log_likelihood = 0.0;  ///< of the observed velocities under its field
  double log_prior = 0.0;
  double score = 0.0;  ///< likelihood_power * log_likelihood + log_prior
};

struct Candidates {
  std::span<Candidate> list;  ///< best first, at most max_candidates, each at least min_relative_weight of the best
  double novelty = 1.0;       ///< mean over the observed samples of var / sigma_f^2 of the field that knows it best
};

/// Selects, from the transitions nearby, those whose fields cover the last observed point and enough points before it;
/// scores them by the likelihood of the observed velocities. Source: docs/predict.md, section 1.
Candidates find_candidates(const FlowFieldIndex& map, std::span<const int> near, const CurbTrajectory& observed,
                           const PredictConfig& config, Scratch& scratch);

}  // namespace sila
