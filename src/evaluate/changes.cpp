#include <algorithm>
#include <array>
#include <cmath>

#include "sila/evaluate/metrics.hpp"

namespace sila {
namespace {

/// Expected calibration error over ten bins of equal width.
class CalibrationError {
 public:
  void add(double probability, bool came) {
    const double excess = probability - (came ? 1.0 : 0.0);
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

double square(double x) {
  return x * x;
}

}  // namespace

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
      const bool came = k == static_cast<std::size_t>(forecast.came);
      const double probability = forecast.probabilities[k];
      score.rates[k] += (came ? 1.0 : 0.0) / count;
      score.stated[k] += probability / count;
      score.brier += square(probability - (came ? 1.0 : 0.0)) / count;
      error.add(probability, came);
    }
  }
  for (const double rate : score.rates)
    score.base_brier += rate * std::max(0.0, 1.0 - rate);  // sums may exceed 1 by rounding
  score.calibration_error = error.value();
  return score;
}

}  // namespace sila
