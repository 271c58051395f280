// The verbs of one model file: inspect, log, rollback, verify.

#include "options.hpp"

namespace sila::cli {
namespace {

struct ModelOptions {
  CommonOptions common;
  std::string model;
  std::optional<int> to, keep;  ///< of a rollback
};

void inspect(const ModelOptions& options) {
  const StoredModel stored = load_model(options.model);
  print(options.common, inspect_json(stored), describe(stored));
}

void list_episodes(const ModelOptions& options) {
  ModelFile file = ModelFile::open(options.model);
  const StoredModel stored = file.read();
  const int oldest = file.oldest_rollback();
  print(options.common, log_json(stored, oldest), describe_log(stored, oldest));
}

void roll_back(const ModelOptions& options) {
  if (!options.to && !options.keep) throw UsageError("rollback: --to or --keep is needed");
  ModelFile file = ModelFile::open(options.model);
  if (options.to) file.rollback(*options.to);
  if (options.keep) file.keep_undo(*options.keep);
  const StoredModel stored = file.read();
  const int last = last_episode(stored), oldest = file.oldest_rollback();
  print(options.common, {{"model", options.model}, {"last", last}, {"oldest", oldest}, {"size", size(stored.model)}},
        options.model + (options.to ? ": as it was" : ": unchanged") + " after episode " + std::to_string(last) + ", " +
            counted(stored.model.primitives.size(), "primitive") + ", " +
            counted(stored.model.transitions.size(), "transition") +
            "; the oldest model that is kept is that of episode " + std::to_string(oldest) + "\n");
}

void verify(const ModelOptions& options) {
  const VerifyReport report = ModelFile::open(options.model).verify();
  print(options.common,
        {{"model", options.model},
         {"intact", true},
         {"pages", report.pages},
         {"episodes", report.episodes},
         {"undone", report.undone}},
        options.model + ": intact; " + std::to_string(report.pages) + " pages, " +
            counted(report.episodes, "recorded episode") + ", " + std::to_string(report.undone) +
            " of which can be undone\n");
}

Verb<ModelOptions> add_model_verb(CLI::App& app, const VerbText& text, void (*run)(const ModelOptions&)) {
  const auto verb = add_verb(app, text, Shared::json, run);
  verb.app->add_option("model", verb.options->model, "model file")->required()->type_name("M.sila");
  return verb;
}

}  // namespace

void add_inspect(CLI::App& app) {
  add_model_verb(app, {"inspect", "Print the contents of a model.", "sila inspect corner.sila"}, inspect);
}

void add_log(CLI::App& app) {
  add_model_verb(app, {"log", "List the episodes of a model and what each one changed.", "sila log corner.sila"},
                 list_episodes);
}

void add_rollback(CLI::App& app) {
  const auto [verb, options] = add_model_verb(
      app, {"rollback", "Restore a model as it was after an earlier episode.", "sila rollback corner.sila --to 12"},
      roll_back);
  verb->add_option("--to", options->to, "episode to go back to; `sila log` lists them")->type_name("N");
  verb->add_option("--keep", options->keep,
                   "from now on keep the models of this many episodes before the last; 0 keeps none [" +
                       std::to_string(kUndoKept) + "]")
      ->check(CLI::Range(0, 1000000000));
}

void add_verify(CLI::App& app) {
  add_model_verb(app, {"verify", "Check every page, record and kept model of a file.", "sila verify corner.sila"},
                 verify);
}

}  // namespace sila::cli
