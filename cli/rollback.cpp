#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "options.hpp"
#include "sila/core/counted.hpp"
#include "sila/io/model_file.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct RollbackOptions {
  CommonOptions common;
  std::string model;
  std::optional<int> to, keep;
};

void roll_back(const RollbackOptions& options) {
  if (!options.to && !options.keep) throw std::invalid_argument("rollback: --to or --keep is needed");
  ModelFile file = ModelFile::open(options.model);
  if (options.to) file.rollback(*options.to);
  if (options.keep) file.keep_undo(*options.keep);
  const StoredModel stored = file.read();
  const int last = stored.episodes.empty() ? 0 : stored.episodes.back().number, oldest = file.oldest_rollback();
  if (options.common.json) {
    std::cout << nlohmann::ordered_json{{"model", options.model},
                                        {"last", last},
                                        {"oldest", oldest},
                                        {"size", size(stored.model)}}
                     .dump(2)
              << "\n";
  } else {
    std::cout << options.model << ": as it was after episode " << last << ", "
              << counted(stored.model.primitives.size(), "primitive") << ", "
              << counted(stored.model.transitions.size(), "transition")
              << "; the oldest model that is kept is that of episode " << oldest << "\n";
  }
}

}  // namespace

void add_rollback(CLI::App& app) {
  auto options = std::make_shared<RollbackOptions>();
  CLI::App* verb = add_plain_verb(app, "rollback", "Make a model what it was after an earlier episode.",
                                  "sila rollback corner.sila --to 12", options->common);
  verb->add_option("model", options->model, "model file")->required()->type_name("M.sila");
  verb->add_option("--to", options->to, "episode to go back to; `sila log` lists them")->type_name("N");
  verb->add_option("--keep", options->keep,
                   "from now on keep the models of this many episodes before the last; 0 keeps none [" +
                       std::to_string(kUndoKept) + "]")
      ->check(CLI::Range(0, 1000000000));
  verb->callback([options] { roll_back(*options); });
}

}  // namespace sila::cli
