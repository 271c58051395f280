#pragma once

#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// A transition that a mode uses.
struct TransitionUse {
  int from = 0, to = 0;
  double tracks = 0.0;  ///< that showed it, T(from, to)
};

/// One roll-out of a mode, and the terms of its weight: exp(likelihood_power * log_likelihood + log_prior) *
/// chain_probability, relative to the best.
struct RolloutExplanation {
  double weight = 0.0;  ///< relative to all roll-outs that were kept
  double log_likelihood = 0.0;
  double log_prior = 0.0;
  double chain_probability = 1.0;  ///< product of P(k | j) where it branched
  std::vector<TransitionUse> transitions;
};

struct ModeExplanation {
  double weight = 0.0;
  VariantKind variant = VariantKind::expected;
  std::vector<int> primitives;
  std::vector<RolloutExplanation> rollouts;  ///< heaviest first
};

/// Why a prediction is what it is.
struct Explanation {
  std::vector<ModeExplanation> modes;  ///< in the order of the prediction's
  double likelihood_power = 1.0;
  double effective_samples = 0.0;  ///< that the residual GPs rest on
  double raw_novelty = 0.0;  ///< mean over the scored samples of var / sigma_f^2 of the field that knows each best
  double at_least_as_novel = 0.0;  ///< share of the people seen so far who were at least as surprising
};

Explanation explain(const Predictor& predictor, const CurbTrajectory& observed);

}  // namespace sila
