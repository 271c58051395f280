// Verbs that only the program `sila` of the Python package carries out.

#include <string>

#include "verbs.hpp"

namespace sila::cli {
namespace {

void add_python_verb(CLI::App& app, const std::string& name, const std::string& what, const std::string& extra) {
  CLI::App* verb = app.add_subcommand(name, what + " (in the Python package).");
  verb->prefix_command();
  verb->footer("Its options: pip install 'sila[" + extra + "]', then `sila " + name + " --help`.");
  verb->callback(
      [=] { throw UsageError(name + ": comes with the Python package; pip install 'sila[" + extra + "]'"); });
}

}  // namespace

void add_experiment(CLI::App& app) {
  add_python_verb(app, "experiment", "Compare methods on scenes, trial by trial", "experiments");
}

void add_fleet(CLI::App& app) {
  add_python_verb(app, "fleet", "Learn many places in parallel on Dask", "fleet");
}

}  // namespace sila::cli
