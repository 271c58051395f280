#include "sila/refine/prediction_json.hpp"

#include <nlohmann/json.hpp>

namespace sila {

namespace {

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
  nlohmann::ordered_json json{{"likelihood_power", explanation.likelihood_power},
                              {"alike", explanation.alike},
                              {"raw_novelty", explanation.raw_novelty},
                              {"at_least_as_novel", explanation.at_least_as_novel}};
  json["modes"] = nlohmann::ordered_json::array();
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
    json["modes"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace

std::string prediction_line(const std::string& track, const Prediction& prediction, const Explanation* explanation) {
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
    entry["variant"] = kVariantKinds[static_cast<std::size_t>(mode.variant)];
    line["modes"].push_back(std::move(entry));
  }
  if (!prediction.regions.empty()) line["regions"] = regions_json(prediction.regions);
  if (explanation) line["explanation"] = explanation_json(*explanation);
  // A track id that is not UTF-8 must not cost the line.
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace sila
