#include "sila/io/prediction_json.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "sila/core/errors.hpp"

namespace sila {
namespace {

using nlohmann::json;

nlohmann::ordered_json regions_json(const std::vector<Region>& regions) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Region& region : regions) list.push_back({{"probability", region.probability}, {"level", region.levels}});
  return list;
}

nlohmann::ordered_json transitions_json(const std::vector<TransitionUse>& transitions) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const TransitionUse& use : transitions)
    list.push_back({{"from", use.from}, {"to", use.to}, {"tracks", use.tracks}});
  return list;
}

nlohmann::ordered_json explanation_json(const Explanation& explanation) {
  nlohmann::ordered_json result{{"likelihood_power", explanation.likelihood_power},
                                {"effective_samples", explanation.effective_samples},
                                {"raw_novelty", explanation.raw_novelty},
                                {"at_least_as_novel", explanation.at_least_as_novel}};
  result["modes"] = nlohmann::ordered_json::array();
  for (const ModeExplanation& mode : explanation.modes) {
    nlohmann::ordered_json entry{{"weight", mode.weight},
                                 {"variant", kVariantKinds[static_cast<std::size_t>(mode.variant)]},
                                 {"primitives", mode.primitives}};
    entry["rollouts"] = nlohmann::ordered_json::array();
    for (const RolloutExplanation& rollout : mode.rollouts) {
      entry["rollouts"].push_back({{"weight", rollout.weight},
                                   {"log_likelihood", rollout.log_likelihood},
                                   {"log_prior", rollout.log_prior},
                                   {"chain_probability", rollout.chain_probability},
                                   {"transitions", transitions_json(rollout.transitions)}});
    }
    result["modes"].push_back(std::move(entry));
  }
  return result;
}

void add_image(nlohmann::ordered_json& entry, const Mode& mode, const Camera& camera) {
  for (const char* key : {"u", "v", "cov_uv"}) entry[key] = nlohmann::ordered_json::array();
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const std::optional<Vector2> image_px = to_image(camera, mode.path_m[j]);
    if (!image_px) {
      for (const char* key : {"u", "v", "cov_uv"}) entry[key].push_back(nullptr);
      continue;
    }
    const Matrix2 jacobian = image_jacobian(camera, mode.path_m[j]);
    const Matrix2 c = jacobian * mode.covariances_m2[j] * jacobian.transpose();
    entry["u"].push_back(image_px->x());
    entry["v"].push_back(image_px->y());
    entry["cov_uv"].push_back({c(0, 0), c(0, 1), c(1, 1)});
  }
}

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

std::string prediction_line(const std::string& track, const Prediction& prediction, const Explanation* explanation,
                            const Camera* camera) {
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
    for (const Vector2& position : mode.path_m) {
      x.push_back(position.x());
      y.push_back(position.y());
    }
    entry["x"] = x;
    entry["y"] = y;
    entry["cov"] = nlohmann::ordered_json::array();
    for (const Matrix2& c : mode.covariances_m2) entry["cov"].push_back({c(0, 0), c(0, 1), c(1, 1)});
    if (camera != nullptr) add_image(entry, mode, *camera);
    entry["primitives"] = mode.primitives;
    entry["variant"] = kVariantKinds[static_cast<std::size_t>(mode.variant)];
    line["modes"].push_back(std::move(entry));
  }
  if (!prediction.regions.empty()) line["regions"] = regions_json(prediction.regions);
  if (explanation) line["explanation"] = explanation_json(*explanation);
  // A track id that is not UTF-8 must not cost the line.
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

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

}  // namespace sila
