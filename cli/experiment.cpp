#include <stdexcept>

#include "verbs.hpp"

namespace sila::cli {

/// Experiments are in the Python package; the program `sila` of that package has this verb.
void add_experiment(CLI::App& app) {
  CLI::App* verb =
      app.add_subcommand("experiment", "Compare methods on scenes, trial by trial (in the Python package).");
  verb->prefix_command();
  verb->callback([] {
    throw std::invalid_argument("experiment: comes with the Python package; pip install 'sila[experiments]'");
  });
}

}  // namespace sila::cli
