#include "sila/evaluate/recorded.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "sila/core/errors.hpp"
#include "sila/evaluate/split.hpp"

namespace sila {
namespace {

using nlohmann::json;

Mode mode_of(const json& object) {
  Mode mode;
  mode.weight = object.at("weight").get<double>();
  const json &x = object.at("x"), &y = object.at("y"), &cov = object.at("cov");
  for (std::size_t j = 0; j < x.size(); ++j) {
    mode.path_m.emplace_back(x.at(j).get<double>(), y.at(j).get<double>());
    const json& entry = cov.at(j);
    Matrix2 covariance;
    covariance << entry.at(0).get<double>(), entry.at(1).get<double>(), entry.at(1).get<double>(),
        entry.at(2).get<double>();
    mode.covariances_m2.push_back(covariance);
  }
  return mode;
}

Prediction prediction_of(const json& object) {
  Prediction prediction;
  prediction.t0_s = object.at("t0").get<double>();
  prediction.times_s = object.at("modes").at(0).at("t").get<std::vector<double>>();
  prediction.fallback = object.at("fallback").get<bool>();
  prediction.novelty = object.at("novelty").get<double>();
  for (const json& mode : object.at("modes")) prediction.modes.push_back(mode_of(mode));
  if (!object.contains("regions")) return prediction;
  for (const json& region : object.at("regions"))
    prediction.regions.push_back(
        {region.at("probability").get<double>(), region.at("level").get<std::vector<double>>()});
  return prediction;
}

}  // namespace

RecordedPredictions read_predictions(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw FormatError(path.string(), 0, "a file of predictions", "no file that can be read");
  RecordedPredictions recorded;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const json object = json::parse(line, nullptr, false);
    if (object.is_object() && !object.contains("modes")) continue;
    try {
      Prediction prediction = prediction_of(object);
      const double t0_s = prediction.t0_s;
      recorded[{object.at("track").get<std::string>(), t0_s}] = std::move(prediction);
    } catch (const json::exception& error) {
      throw FormatError(path.string(), number, "a prediction", error.what());
    }
  }
  return recorded;
}

Forecast forecast_of(const RecordedPredictions& recorded) {
  return [&recorded](const CurbTrajectory& observed) {
    for (const std::string& track : {observed.id, person_of(observed.id)}) {
      const auto found = recorded.find({track, observed.times_s.back()});
      if (found != recorded.end()) return found->second;
    }
    return Prediction{};
  };
}

}  // namespace sila
