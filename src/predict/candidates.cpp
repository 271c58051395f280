#include "sila/predict/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sila {
namespace {

double log_normal(double difference, double variance) {
  return -0.5 * (std::log(2.0 * std::numbers::pi * variance) + difference * difference / variance);
}

double log_prior(const FieldMap::Field& field, double variance_here, WeightPrior prior) {
  switch (prior) {
    case WeightPrior::transition_probability:
      return std::log(field.probability);
    case WeightPrior::local_evidence: {
      // How many direct observations of the velocity at this point would leave the same variance.
      const double samples = field.noise_variance * (1.0 / variance_here - 1.0 / field.signal_variance);
      return std::log(std::max(samples, 1e-12));
    }
    case WeightPrior::none:
      return 0.0;
  }
  return 0.0;
}

std::size_t first_of_last(std::size_t samples, double seconds, double interval_s) {
  const auto wanted = static_cast<std::size_t>(std::max(1L, std::lround(seconds / interval_s)));
  return samples > wanted ? samples - wanted : 0;
}

}  // namespace

Candidates find_candidates(const FieldMap& map, const CurbTrajectory& observed, const PredictConfig& config) {
  Candidates found;
  const std::size_t samples = observed.positions.size();
  if (samples == 0) return found;
  const double interval_s = samples > 1 ? observed.times_s[1] - observed.times_s[0] : 1.0;
  const std::size_t first = first_of_last(samples, config.evidence_s, interval_s);
  std::vector<double> least_known(samples - first, 1.0);
  for (const int index : map.near(observed.positions.back())) {
    const FieldMap::Field& field = map.field(index);
    const double here = field.posterior.predict_flow(observed.positions.back()).variance;
    if (here >= config.support_ratio * field.signal_variance) continue;
    Candidate candidate{index, 0.0, log_prior(field, here, config.prior), 0.0};
    int supported = 0;
    for (std::size_t t = first; t < samples; ++t) {
      const FlowPrediction flow = field.posterior.predict_flow(observed.positions[t]);
      const Vector2 difference = observed.velocities[t] - flow.mean;
      const double variance = flow.variance + field.noise_variance;
      candidate.log_likelihood += log_normal(difference.x(), variance) + log_normal(difference.y(), variance);
      const double unknown = flow.variance / field.signal_variance;
      supported += unknown < config.support_ratio ? 1 : 0;
      least_known[t - first] = std::min(least_known[t - first], unknown);
    }
    if (supported < std::min(config.min_supported_samples, static_cast<int>(samples - first))) continue;
    candidate.score = config.likelihood_power * candidate.log_likelihood + candidate.log_prior;
    found.list.push_back(candidate);
  }
  double unknown = 0.0;
  for (double ratio : least_known) unknown += ratio;
  found.novelty = unknown / static_cast<double>(least_known.size());
  std::stable_sort(found.list.begin(), found.list.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  std::size_t kept = 0;
  while (kept < found.list.size() && kept < static_cast<std::size_t>(config.max_candidates) &&
         found.list[kept].score >= found.list.front().score + std::log(config.min_relative_weight)) {
    ++kept;
  }
  found.list.resize(kept);
  return found;
}

}  // namespace sila
