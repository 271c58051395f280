#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "options.hpp"
#include "sila/evaluate/compare.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/model_store.hpp"
#include "sila/train/episode.hpp"
#include "threads.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct DiffOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string a, b;
};

/// What both models are asked to predict: windows of the given tracks, or paths traced from what they know.
std::vector<CurbTrajectory> asked(const DiffOptions& options, const Model& a, const Model& b, const Config& config) {
  const PredictConfig& predict = config.episode.predict;
  std::vector<CurbTrajectory> paths;
  if (!options.tracks.scene.empty()) {
    const SceneTracks input = read_placed(options.tracks, config);
    for (Window& window : windows_of(input.tracks, config.episode.sampling, predict, config.evaluate.every_s))
      paths.push_back(std::move(window.observed));
    return paths;
  }
  paths = traced_paths(a, predict.observe_s);
  for (CurbTrajectory& path : traced_paths(b, predict.observe_s)) paths.push_back(std::move(path));
  return paths;
}

nlohmann::ordered_json to_json(const ModelComparison& difference) {
  nlohmann::ordered_json primitives{{"same", difference.same_primitives}},
      transitions{{"same", difference.same_transitions}};
  primitives["changed"] = transitions["changed"] = nlohmann::ordered_json::array();
  for (const PrimitivePair& pair : difference.changed_primitives)
    primitives["changed"].push_back({{"a", pair.a}, {"b", pair.b}, {"similarity", pair.similarity}});
  primitives["only_a"] = difference.primitives_of_a, primitives["only_b"] = difference.primitives_of_b;
  for (const TransitionPair& pair : difference.changed_transitions)
    transitions["changed"].push_back(
        {{"a", pair.a}, {"b", pair.b}, {"count_a", pair.count_a}, {"count_b", pair.count_b}});
  transitions["only_a"] = difference.transitions_of_a, transitions["only_b"] = difference.transitions_of_b;
  return {{"primitives", std::move(primitives)}, {"transitions", std::move(transitions)}};
}

std::string line_of(const char* name, std::size_t same, std::size_t changed, std::size_t only_a, std::size_t only_b) {
  std::ostringstream text;
  text << std::left << std::setw(13) << name << same << " the same, " << changed << " changed, " << only_a
       << " only in A, " << only_b << " only in B\n";
  return std::move(text).str();
}

template <class List, class Text>
void list(const char* title, const List& items, Text&& text) {
  if (items.empty()) return;
  std::cout << "  " << title << ":";
  for (const auto& item : items) std::cout << " " << text(item);
  std::cout << "\n";
}

void tell(const ModelComparison& difference, const std::vector<HorizonDifference>& apart, std::size_t paths) {
  const auto edge = [](const std::pair<int, int>& pair) {
    return std::to_string(pair.first) + "->" + std::to_string(pair.second);
  };
  const auto number = [](int primitive) { return std::to_string(primitive); };
  std::cout << line_of("primitives", difference.same_primitives, difference.changed_primitives.size(),
                       difference.primitives_of_a.size(), difference.primitives_of_b.size());
  list("changed (A=B)", difference.changed_primitives,
       [&](const PrimitivePair& pair) { return number(pair.a) + "=" + number(pair.b); });
  list("only in A", difference.primitives_of_a, number), list("only in B", difference.primitives_of_b, number);
  std::cout << line_of("transitions", difference.same_transitions, difference.changed_transitions.size(),
                       difference.transitions_of_a.size(), difference.transitions_of_b.size());
  list("changed (of A)", difference.changed_transitions, [&](const TransitionPair& pair) { return edge(pair.a); });
  list("only in A", difference.transitions_of_a, edge), list("only in B", difference.transitions_of_b, edge);
  std::cout << "predictions  mean paths on " << paths << " windows are apart by\n"
            << std::fixed << std::setprecision(3);
  for (const HorizonDifference& horizon : apart) {
    std::cout << "  at " << std::setprecision(1) << horizon.horizon_s << std::setprecision(3)
              << " s: " << horizon.mean_m << " m on average, " << horizon.max_m << " m at most\n";
  }
}

void diff_models(const DiffOptions& options) {
  const ThreadLimit limit(options.common.threads);
  if (options.tracks.scene.empty() && !options.tracks.paths.empty())
    throw std::invalid_argument("diff: --scene is needed where tracks are given");
  const StoredModel a = load_model(options.a), b = load_model(options.b);
  const Config base = apply_json(Config{}, nlohmann::json::parse(a.configuration), options.a);
  const Config config = configured(options.common, base);
  const ModelComparison difference = compare(a.model, b.model, config.episode.fuse.similarity_threshold);
  const Predictor of_a(a.model, config.episode.predict), of_b(b.model, config.episode.predict);
  const std::vector<CurbTrajectory> paths = asked(options, a.model, b.model, config);
  const std::vector<HorizonDifference> apart = compare_predictions(of_a, of_b, paths);
  if (!options.common.json) return tell(difference, apart, paths.size());
  nlohmann::ordered_json json = to_json(difference);
  json["windows"] = paths.size();
  json["predictions"] = nlohmann::ordered_json::array();
  for (const HorizonDifference& horizon : apart)
    json["predictions"].push_back(
        {{"horizon_s", horizon.horizon_s}, {"mean_m", horizon.mean_m}, {"max_m", horizon.max_m}});
  std::cout << json.dump(2) << "\n";
}

}  // namespace

void add_diff(CLI::App& app) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* verb = add_verb(app, "diff", "Tell what differs between two models, and by how much their predictions do.",
                            "sila diff monday.sila tuesday.sila", options->common);
  verb->add_option("a", options->a, "model file")->required()->type_name("A.sila");
  verb->add_option("b", options->b, "model file")->required()->type_name("B.sila");
  add_tracks(*verb, options->tracks, false);
  verb->callback([options] { diff_models(*options); });
}

}  // namespace sila::cli
