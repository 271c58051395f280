#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "predict/rollout.hpp"

namespace sila {
namespace {

/// Number of transitions that are scored on the whole window, for each that may be rolled out.
constexpr std::size_t kScoredPerCandidate = 2;

/// Log density of two independent differences.
double log_normal(const Vector2& differences, const Vector2& variance) {
  constexpr double two_pi = 2.0 * std::numbers::pi;
  if (variance.x() == variance.y()) [[likely]]  // outputs that share a GP: one logarithm
    return -std::log(two_pi * variance.x()) - 0.5 * differences.squaredNorm() / variance.x();
  return -0.5 * ((two_pi * variance.array()).log() + differences.array().square() / variance.array()).sum();
}

double log_prior(const FlowFieldIndex::Field& field, const Vector2& variance_here, WeightPrior prior) {
  if (prior == WeightPrior::none) return 0.0;
  if (prior == WeightPrior::transition_probability) return std::log(field.probability);
  // The number of direct observations of the velocity at this point that would give the same variance.
  const Vector2 samples = field.posterior.noise_variance().array() *
                          (variance_here.cwiseInverse() - field.posterior.signal_variance().cwiseInverse()).array();
  return std::log(std::max(samples.mean(), 1e-12));
}

/// Likelihood and prior of one field by the last sample; null if the field does not cover it. `least_unexplained`
/// becomes the smaller var / sigma_f^2 at that sample.
std::optional<Candidate> score(const FlowFieldIndex::Field& field, int index, const CurbTrajectory& observed,
                               double& least_unexplained, const PredictConfig& config) {
  const FieldPrediction here = field.posterior.predict(observed.positions.back());
  const double unexplained = field.posterior.unexplained_share(here);
  if (unexplained >= config.support_ratio) return std::nullopt;
  least_unexplained = std::min(least_unexplained, unexplained);
  const double log_likelihood =
      log_normal(observed.velocities.back() - here.mean, here.variance + field.posterior.noise_variance());
  return Candidate{index, log_likelihood, log_prior(field, here.variance, config.prior), 0.0};
}

/// Adds the terms of the earlier samples; false if the field covers too few of them. `least_unexplained` becomes the
/// smaller var / sigma_f^2 at each sample.
bool add_earlier_samples(Candidate& candidate, const FlowFieldIndex::Field& field, const CurbTrajectory& observed,
                         std::span<double> least_unexplained, const PredictConfig& config) {
  const std::size_t first = observed.positions.size() - least_unexplained.size();
  int supported = 1;
  for (std::size_t t = first; t + 1 < observed.positions.size(); ++t) {
    const FieldPrediction flow = field.posterior.predict(observed.positions[t]);
    candidate.log_likelihood +=
        log_normal(observed.velocities[t] - flow.mean, flow.variance + field.posterior.noise_variance());
    const double unexplained = field.posterior.unexplained_share(flow);
    supported += unexplained < config.support_ratio ? 1 : 0;
    least_unexplained[t - first] = std::min(least_unexplained[t - first], unexplained);
  }
  candidate.score = config.likelihood_power * candidate.log_likelihood + candidate.log_prior;
  return supported >= std::min(config.min_supported_samples, static_cast<int>(least_unexplained.size()));
}

bool better(const Candidate& a, const Candidate& b) {
  return a.score != b.score ? a.score > b.score : a.transition < b.transition;
}

/// If very many transitions overlap, those with the lowest score of the last sample alone are left out.
std::span<Candidate> shortlist(std::span<Candidate> list, std::size_t samples, const PredictConfig& config) {
  const std::size_t most = kScoredPerCandidate * static_cast<std::size_t>(config.max_candidates);
  if (list.size() <= most) return list;
  for (Candidate& candidate : list)
    candidate.score =
        config.likelihood_power * static_cast<double>(samples) * candidate.log_likelihood + candidate.log_prior;
  std::nth_element(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(most), list.end(), better);
  return list.first(most);
}

/// Number of the candidates, best first, that are rolled out.
std::size_t count_rolled_out(std::span<const Candidate> list, const PredictConfig& config) {
  std::size_t kept = 0;
  while (kept < list.size() && kept < static_cast<std::size_t>(config.max_candidates) &&
         list[kept].score >= list.front().score + std::log(config.min_relative_weight)) {
    ++kept;
  }
  return kept;
}

}  // namespace

Candidates find_candidates(const FlowFieldIndex& fields, std::span<const int> near, const CurbTrajectory& observed,
                           const PredictConfig& config, Scratch& scratch) {
  Candidates found;
  const std::size_t samples = observed.positions.size();
  const double interval_s = samples > 1 ? observed.times_s[1] - observed.times_s[0] : 1.0;
  const auto scored = static_cast<std::size_t>(std::max(1L, std::lround(config.likelihood_s / interval_s)));
  const auto least_unexplained = scratch.array<double>(std::min(samples, scored));
  std::fill(least_unexplained.begin(), least_unexplained.end(), 1.0);
  const auto list = scratch.array<Candidate>(near.size());
  std::size_t count = 0;
  for (const int index : near) {
    if (const auto candidate = score(fields.field(index), index, observed, least_unexplained.back(), config))
      list[count++] = *candidate;
  }
  const std::span<Candidate> shorter = shortlist(list.first(count), least_unexplained.size(), config);
  const auto end = std::remove_if(shorter.begin(), shorter.end(), [&](Candidate& candidate) {
    return !add_earlier_samples(candidate, fields.field(candidate.transition), observed, least_unexplained, config);
  });
  found.list = shorter.first(static_cast<std::size_t>(end - shorter.begin()));
  found.raw_novelty = std::accumulate(least_unexplained.begin(), least_unexplained.end(), 0.0) /
                      static_cast<double>(least_unexplained.size());
  std::sort(found.list.begin(), found.list.end(), better);
  found.list = found.list.first(count_rolled_out(found.list, config));
  return found;
}

}  // namespace sila
