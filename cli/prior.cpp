#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "options.hpp"
#include "sila/core/counted.hpp"
#include "sila/io/model_file.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct PriorOptions {
  CommonOptions common;
  std::vector<std::string> models;
  std::string out;
};

void make(const PriorOptions& options) {
  require_no_records("--out", options.out);
  std::vector<StoredModel> models;
  for (const std::string& path : options.models) models.push_back(load_model(path));
  const StoredModel prior = stored_prior(models);
  save_model(options.out, prior);
  const double windows = windows_in(prior.model.prior.density);
  if (options.common.json) {
    std::cout << nlohmann::ordered_json{{"models", models.size()}, {"windows", windows}}.dump(2) << "\n";
    return;
  }
  std::cout << options.out << ": a prior of " << counted(std::lround(windows), "window") << ", from "
            << counted(models.size(), "model") << "; begin each new place with a copy of it\n";
}

}  // namespace

void add_prior(CLI::App& app) {
  CLI::App* group = app.add_subcommand("prior", "Begin the model of a new place with how people walk at other places.");
  group->require_subcommand(1);
  group->footer("`sila prior make --help` has an example.");
  auto options = std::make_shared<PriorOptions>();
  CLI::App* verb = add_plain_verb(*group, "make", "Make the first model of a new place from models of other places.",
                                  "sila prior make a.sila b.sila --out new.sila", options->common);
  verb->add_option("models", options->models, "models of other places, with the same windows")
      ->required()
      ->type_name("M.sila");
  verb->add_option("--out", options->out, "model file to write; it has no tracks yet")->required()->type_name("P.sila");
  verb->callback([options] { make(*options); });
}

}  // namespace sila::cli
