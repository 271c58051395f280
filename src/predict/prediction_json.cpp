#include "sila/predict/prediction_json.hpp"

#include <nlohmann/json.hpp>

namespace sila {

std::string prediction_line(const std::string& track, const Prediction& prediction) {
  nlohmann::ordered_json line;
  line["track"] = track;
  line["t0"] = prediction.t0_s;
  line["fallback"] = prediction.fallback;
  line["novelty"] = prediction.novelty;
  line["modes"] = nlohmann::ordered_json::array();
  for (const Mode& mode : prediction.modes) {
    nlohmann::ordered_json entry;
    entry["weight"] = mode.weight;
    entry["t"] = prediction.times_s;
    std::vector<double> x, y;
    for (const Vector2& position : mode.path_m) x.push_back(position.x()), y.push_back(position.y());
    entry["x"] = x;
    entry["y"] = y;
    entry["cov"] = nlohmann::ordered_json::array();
    for (const Matrix2& c : mode.covariances_m2) entry["cov"].push_back({c(0, 0), c(0, 1), c(1, 1)});
    entry["primitives"] = mode.primitives;
    line["modes"].push_back(std::move(entry));
  }
  // A track id that is not UTF-8 must not cost the line.
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace sila
