#include "sila/evaluate/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {
namespace {

double mean_distance_m(std::span<const Vector2> a, std::span<const Vector2> b) {
  double sum = 0.0;
  for (std::size_t j = 0; j < a.size(); ++j) sum += (a[j] - b[j]).norm();
  return sum / static_cast<double>(a.size());
}

/// Expected calibration error over ten bins of equal width.
class CalibrationError {
 public:
  void add(double probability, bool happened) {
    const double excess = probability - (happened ? 1.0 : 0.0);
    excess_[std::min(kBins - 1, static_cast<std::size_t>(probability * kBins))] += excess;
    count_ += 1.0;
  }
  double value() const {
    double sum = 0.0;
    for (const double excess : excess_) sum += std::abs(excess) / count_;
    return sum;
  }

 private:
  static constexpr std::size_t kBins = 10;
  std::array<double, kBins> excess_{};  ///< of the stated over the observed number
  double count_ = 0.0;
};

double mean_nearest_m(std::span<const Vector2> from, std::span<const Vector2> to) {
  double sum = 0.0;
  for (const Vector2& a : from) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector2& b : to) nearest = std::min(nearest, (a - b).squaredNorm());
    sum += std::sqrt(nearest);
  }
  return sum / static_cast<double>(from.size());
}

/// For each region 1 if it covers a point; without regions those of a Gaussian.
decltype(Metrics::coverage) coverage_of(const Prediction& prediction, std::size_t step, const Vector2& point_m) {
  const std::vector<Region>& regions = prediction.regions;
  if (!regions.empty() && !std::ranges::equal(regions, kRegionProbabilities, {}, &Region::probability))
    throw invalid_argument("measure: regions must be none, or have the probabilities ",
                           joined(kRegionProbabilities, ", ", [](double p) { return concatenate(p); }));
  const double score = nonconformity(prediction, step, point_m);
  decltype(Metrics::coverage) coverage = {};
  for (std::size_t p = 0; p < coverage.size(); ++p) {
    const double level = regions.empty() ? -std::log1p(-kRegionProbabilities[p]) : regions[p].levels[step];
    coverage[p] = score <= level ? 1.0 : 0.0;
  }
  return coverage;
}

}  // namespace

Metrics measure(const Prediction& prediction, std::span<const Vector2> truth_m, std::size_t steps) {
  if (steps == 0 || truth_m.size() < steps || prediction.modes.empty() ||
      prediction.modes.front().path_m.size() < steps) {
    throw invalid_argument("measure: steps = ", steps, ", but the truth has ", truth_m.size(), " and the prediction ",
                           prediction.times_s.size(), "; predict with this horizon");
  }
  const std::vector<Vector2> mean_m = mean_path(prediction, steps);  // rejects modes of different lengths
  const auto truth = truth_m.first(steps);
  Metrics metrics;
  metrics.best_mhd_m = metrics.best_ade_m = metrics.best_fde_m = std::numeric_limits<double>::infinity();
  for (std::size_t m = 0; m < prediction.modes.size(); ++m) {
    const Mode& mode = prediction.modes[m];
    const auto path = std::span(mode.path_m).first(steps);
    const double mhd_m = modified_hausdorff_m(path, truth);
    const double ade_m = mean_distance_m(path, truth), fde_m = (path.back() - truth.back()).norm();
    metrics.weighted_mhd_m += mode.weight * mhd_m;
    metrics.best_mhd_m = std::min(metrics.best_mhd_m, mhd_m);
    metrics.best_ade_m = std::min(metrics.best_ade_m, ade_m);
    metrics.best_fde_m = std::min(metrics.best_fde_m, fde_m);
    if (m == 0) {  // modes come heaviest first
      metrics.most_likely_mhd_m = mhd_m;
      metrics.ade_m = ade_m;
      metrics.fde_m = fde_m;
    }
  }
  metrics.mean_path_mhd_m = modified_hausdorff_m(mean_m, truth);
  metrics.mean_path_ade_m = mean_distance_m(mean_m, truth);
  metrics.mean_path_fde_m = (mean_m.back() - truth.back()).norm();
  for (std::size_t j = 0; j < steps; ++j) {
    const double log_density = std::log(unnormalised_density(prediction, j, truth[j]));
    metrics.nll += (std::log(2.0 * std::numbers::pi) - log_density) / static_cast<double>(steps);
  }
  metrics.coverage = coverage_of(prediction, steps - 1, truth.back());
  return metrics;
}

Metrics operator+(const Metrics& a, const Metrics& b) {
  Metrics sum = a;
  for (const auto& [name, member] : kMetrics) sum.*member += b.*member;
  for (std::size_t p = 0; p < sum.coverage.size(); ++p) sum.coverage[p] += b.coverage[p];
  return sum;
}

Metrics operator*(double factor, const Metrics& a) {
  Metrics scaled = a;
  for (const auto& [name, member] : kMetrics) scaled.*member *= factor;
  for (double& share : scaled.coverage) share *= factor;
  return scaled;
}

ChangeScore score_changes(std::size_t motion_state, double horizon_s, std::span<const ChangeForecast> forecasts) {
  const auto count = static_cast<double>(forecasts.size());
  ChangeScore score{motion_state, horizon_s, forecasts.size(), 0.0, 0.0, 0.0, 0.0};
  CalibrationError error;
  for (const ChangeForecast& forecast : forecasts) {
    const double changed = forecast.changed ? 1.0 : 0.0;
    score.rate += changed / count;
    score.brier += square(forecast.probability - changed) / count;
    error.add(forecast.probability, forecast.changed);
  }
  score.base_brier = score.rate * (1.0 - score.rate);
  score.calibration_error = error.value();
  return score;
}

OutcomeScore score_outcomes(std::size_t motion_state, double horizon_s, std::span<const OutcomeForecast> forecasts) {
  const auto count = static_cast<double>(forecasts.size());
  OutcomeScore score{motion_state, horizon_s, forecasts.size(), {}, {}, 0.0, 0.0, 0.0};
  CalibrationError error;
  for (const OutcomeForecast& forecast : forecasts) {
    for (std::size_t k = 0; k < kOutcomeCount; ++k) {
      const bool happened = k == static_cast<std::size_t>(forecast.actual);
      const double probability = forecast.probabilities[k];
      score.rates[k] += (happened ? 1.0 : 0.0) / count;
      score.stated[k] += probability / count;
      score.brier += square(probability - (happened ? 1.0 : 0.0)) / count;
      error.add(probability, happened);
    }
  }
  for (const double rate : score.rates)
    score.base_brier += rate * std::max(0.0, 1.0 - rate);  // sums may exceed 1 by rounding
  score.calibration_error = error.value();
  return score;
}

double modified_hausdorff_m(std::span<const Vector2> a, std::span<const Vector2> b) {
  if (a.empty() || b.empty()) throw invalid_argument("modified_hausdorff_m: a path is empty");
  return std::max(mean_nearest_m(a, b), mean_nearest_m(b, a));
}

}  // namespace sila
