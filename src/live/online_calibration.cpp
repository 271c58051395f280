#include "sila/live/online_calibration.hpp"

#include <algorithm>
#include <cmath>

namespace sila {
namespace {

/// A level is never changed by more than a factor of e^4: who stands still is always where he is.
constexpr double kMostLogFactor = 4.0;

double log_factor(const OnlineCalibration& online_calibration, double time_s, std::size_t probability) {
  const std::vector<double>& horizons = online_calibration.horizons_s;
  const auto above = std::lower_bound(horizons.begin(), horizons.end(), time_s);
  if (above == horizons.begin()) return online_calibration.log_factors.front()[probability];
  if (above == horizons.end()) return online_calibration.log_factors.back()[probability];
  const auto upper = static_cast<std::size_t>(above - horizons.begin());
  const double share = (time_s - horizons[upper - 1]) / (horizons[upper] - horizons[upper - 1]);
  return (1.0 - share) * online_calibration.log_factors[upper - 1][probability] +
         share * online_calibration.log_factors[upper][probability];
}

}  // namespace

Prediction calibrated(Prediction prediction, const OnlineCalibration& online_calibration) {
  if (online_calibration.horizons_s.empty()) return prediction;
  for (std::size_t p = 0; p < prediction.regions.size(); ++p) {
    std::vector<double>& levels = prediction.regions[p].levels;
    for (std::size_t j = 0; j < levels.size(); ++j) {
      levels[j] *= std::exp(log_factor(online_calibration, prediction.times_s[j], p));
      if (p > 0) levels[j] = std::max(levels[j], prediction.regions[p - 1].levels[j]);
    }
  }
  return prediction;
}

OnlineCalibration fitted(OnlineCalibration online_calibration, const PersonScore& person,
                         const std::vector<double>& horizons_s, double step) {
  if (online_calibration.horizons_s != horizons_s) online_calibration = {horizons_s, {}};
  online_calibration.log_factors.resize(horizons_s.size());
  for (std::size_t h = 0; h < std::min(horizons_s.size(), person.all.size()); ++h) {
    const HorizonSums& sums = person.all[h];
    if (sums.nominal == 0) continue;
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      const double share = sums.inside[p] / static_cast<double>(sums.nominal);
      double& factor = online_calibration.log_factors[h][p];
      factor = std::clamp(factor + step * (kRegionProbabilities[p] - share), -kMostLogFactor, kMostLogFactor);
    }
  }
  return online_calibration;
}

}  // namespace sila
