#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sila/service/scores.hpp"

namespace sila {
namespace {

/// Limit of the factor on a level, e^4: the regions of pedestrians who stand cover every outcome.
constexpr double kMaxLogFactor = 4.0;

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

OnlineCalibration fitted(OnlineCalibration online_calibration, const PedestrianScore& pedestrian,
                         const std::vector<double>& horizons_s, double step) {
  if (online_calibration.horizons_s != horizons_s) online_calibration = {horizons_s, {}};
  online_calibration.log_factors.resize(horizons_s.size());
  for (std::size_t h = 0; h < std::min(horizons_s.size(), pedestrian.all.size()); ++h) {
    const HorizonSums& sums = pedestrian.all[h];
    if (sums.with_regions == 0) continue;
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      const double share = sums.covered[p] / static_cast<double>(sums.with_regions);
      double& factor = online_calibration.log_factors[h][p];
      factor = std::clamp(factor + step * (kRegionProbabilities[p] - share), -kMaxLogFactor, kMaxLogFactor);
    }
  }
  return online_calibration;
}

EpisodeRecord record_of(int number, const Model& previous, const Episode& episode,
                        const OnlineCalibration& online_calibration) {
  EpisodeRecord record = record_of(number, previous, episode);
  nlohmann::ordered_json statistics = nlohmann::ordered_json::parse(record.statistics);
  statistics["online_calibration"] = {{"horizons_s", online_calibration.horizons_s},
                                      {"log_factors", online_calibration.log_factors}};
  record.statistics = statistics.dump();
  return record;
}

OnlineCalibration calibration_in(const StoredModel& stored) {
  if (stored.episodes.empty()) return {};
  try {
    const nlohmann::json kept = nlohmann::json::parse(stored.episodes.back().statistics).at("online_calibration");
    const nlohmann::json& rows = kept.at("log_factors");
    const auto is_row = [](const nlohmann::json& row) { return row.size() == kRegionProbabilities.size(); };
    OnlineCalibration calibration;
    kept.at("horizons_s").get_to(calibration.horizons_s);
    rows.get_to(calibration.log_factors);
    if (calibration.horizons_s.size() == rows.size() && std::ranges::all_of(rows, is_row)) return calibration;
  } catch (const nlohmann::json::exception&) {  // an episode without it, or of another kind: begin anew
  }
  return {};
}

}  // namespace sila
