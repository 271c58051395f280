#include "options.hpp"
#include "sila/train/episode.hpp"

namespace sila::cli {
namespace {

struct DiffOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string a, b;
};

/// The observed paths that both models predict from: windows of the given tracks, or paths traced from the models.
std::vector<CurbTrajectory> observed_paths(const DiffOptions& options, const Model& a, const Model& b,
                                           const Config& config) {
  const RefineConfig& predict = config.episode.predict;
  std::vector<CurbTrajectory> paths;
  if (!options.tracks.scene.empty() || !options.tracks.paths.empty()) {
    const SceneTracks input = read_placed(options.tracks, config, a);
    for (Window& window : windows_of(input.tracks, config.episode.sampling, predict, config.evaluate.stride_s))
      paths.push_back(std::move(window.observed));
    return paths;
  }
  paths = traced_paths(a, predict.observe_s);
  for (CurbTrajectory& path : traced_paths(b, predict.observe_s)) paths.push_back(std::move(path));
  return paths;
}

void diff_models(const DiffOptions& options) {
  const ThreadLimit limit(options.common.threads);
  const StoredModel a = load_model(options.a), b = load_model(options.b);
  const Config config = configured(options.common, a, options.a);
  const ModelComparison difference = compare(a.model, b.model, config.episode.fuse.similarity_threshold);
  const Config config_b = configured(options.common, b, options.b);
  require_one_scale(config, config_b);
  const auto in_b = [&](const Site& site) { return find_site(b.model.sites, site.frame).has_value(); };
  if (std::ranges::none_of(a.model.sites, in_b))
    warn({"the models have no site in common, so at each path one of them predicts as at an unknown place"});
  const Predictor of_a(a.model, config.episode.predict), of_b(b.model, config_b.episode.predict);
  const std::vector<CurbTrajectory> paths = observed_paths(options, a.model, b.model, config);
  const std::vector<HorizonDifference> predictions = compare_predictions(of_a, of_b, paths);
  print(options.common, to_json(difference, predictions, paths.size()),
        describe(difference, predictions, paths.size()));
}

}  // namespace

void add_diff(CLI::App& app) {
  const auto [verb, options] = add_verb(
      app, {"diff", "Compare two models, and their predictions on tracks.", "sila diff monday.sila tuesday.sila"},
      Shared::both, diff_models);
  verb->add_option("A", options->a, "model file")->required()->type_name("A.sila");
  verb->add_option("B", options->b, "model file")->required()->type_name("B.sila");
  add_tracks(*verb, options->tracks);
}

}  // namespace sila::cli
