#include <algorithm>
#include <cmath>

#include "options.hpp"

namespace sila::cli {
namespace {

struct PriorOptions {
  CommonOptions common;
  std::vector<std::string> models;
  std::string out;
};

StoredModel prior_of(const PriorOptions& options) {
  const CommonOptions& common = options.common;
  const auto of_simulation = [](const std::string& assignment) { return assignment.starts_with("simulate."); };
  if (common.seed || std::ranges::any_of(common.sets, of_simulation))
    throw UsageError("prior make: --seed and --set simulate... have no effect: the simulated pedestrians are fixed");
  if (options.models.empty()) {
    const Config config = configured(common);
    return common.config_file.empty() ? of_options([&] { return simulated_prior(config); }) : simulated_prior(config);
  }
  if (!common.profile.empty() || !common.config_file.empty() || !common.sets.empty())
    throw UsageError(
        "prior make: --config, --profile and --set are only for a prior without models; a prior of models has the "
        "configuration of the first one");
  std::vector<StoredModel> models;
  for (const std::string& path : options.models) models.push_back(load_model(path));
  return stored_prior(models);
}

void make_prior_file(const PriorOptions& options) {
  require_no_records("--out", options.out);
  const ThreadLimit limit(options.common.threads);
  const StoredModel prior = prior_of(options);
  save_model(options.out, prior);
  const double windows = windows_in(prior.model.refinement.prior.density);
  print(options.common, {{"models", options.models.size()}, {"windows", windows}},
        options.out + ": a prior of " + counted(std::lround(windows), "window") + ", from " +
            (options.models.empty() ? "simulated pedestrians" : counted(options.models.size(), "model")) +
            "; begin each new place with a copy of it\n");
}

}  // namespace

void add_prior(CLI::App& app) {
  CLI::App* group =
      app.add_subcommand("prior", "Make a prior: the first model of a new place, which has no tracks yet.");
  group->require_subcommand(1);
  group->footer("`sila prior make --help` has an example.");
  const auto [verb, options] = add_verb(
      *group,
      {"make", "Make the first model of a new place from models of other places, or from simulated pedestrians.",
       "sila prior make a.sila b.sila --out new.sila"},
      Shared::both, make_prior_file);
  verb->add_option("models", options->models,
                   "models of other places, of one horizon and sampling; none: simulated pedestrians")
      ->type_name("M.sila");
  verb->add_option("--out", options->out, "model file to write; it has no tracks yet")->required()->type_name("P.sila");
}

}  // namespace sila::cli
