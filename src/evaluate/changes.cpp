#include <algorithm>
#include <array>
#include <cmath>

#include "sila/evaluate/metrics.hpp"

namespace sila {

ChangeScore score_changes(std::size_t motion_state, double horizon_s, std::span<const ChangeForecast> forecasts) {
  constexpr std::size_t bins = 10;
  const auto count = static_cast<double>(forecasts.size());
  ChangeScore score{motion_state, horizon_s, forecasts.size(), 0.0, 0.0, 0.0, 0.0};
  std::array<double, bins> excess{};  // of the stated over the observed number of changes
  for (const ChangeForecast& forecast : forecasts) {
    const double changed = forecast.changed ? 1.0 : 0.0;
    score.rate += changed / count;
    score.brier += (forecast.probability - changed) * (forecast.probability - changed) / count;
    excess[std::min(bins - 1, static_cast<std::size_t>(forecast.probability * bins))] += forecast.probability - changed;
  }
  score.base_brier = score.rate * (1.0 - score.rate);
  for (const double sum : excess) score.calibration_error += std::abs(sum) / count;
  return score;
}

}  // namespace sila
