#include "sila/serve/online_calibration_json.hpp"

#include <algorithm>

namespace sila {
namespace {

using Row = std::array<double, kRegionProbabilities.size()>;

bool is_row(const nlohmann::json& row) {
  return row.is_array() && row.size() == kRegionProbabilities.size() &&
         std::all_of(row.begin(), row.end(), [](const nlohmann::json& value) { return value.is_number(); });
}

}  // namespace

nlohmann::ordered_json to_json(const OnlineCalibration& online_calibration) {
  return {{"horizons_s", online_calibration.horizons_s}, {"log_factors", online_calibration.log_factors}};
}

OnlineCalibration last_calibration(std::span<const EpisodeRecord> episodes) {
  if (episodes.empty()) return {};
  const nlohmann::json statistics = nlohmann::json::parse(episodes.back().statistics, nullptr, false);
  if (!statistics.is_object() || !statistics.contains("online_calibration")) return {};
  const nlohmann::json& kept = statistics["online_calibration"];
  if (!kept.is_object() || !kept.contains("horizons_s") || !kept.contains("log_factors")) return {};
  const nlohmann::json &horizons = kept["horizons_s"], &rows = kept["log_factors"];
  if (!horizons.is_array() || !rows.is_array() || rows.size() != horizons.size()) return {};
  OnlineCalibration online_calibration;
  for (std::size_t h = 0; h < rows.size(); ++h) {
    if (!horizons[h].is_number() || !is_row(rows[h])) return {};
    online_calibration.horizons_s.push_back(horizons[h].get<double>());
    online_calibration.log_factors.push_back(rows[h].get<Row>());
  }
  return online_calibration;
}

}  // namespace sila
