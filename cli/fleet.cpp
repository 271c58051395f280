#include <stdexcept>

#include "verbs.hpp"

namespace sila::cli {

/// The verb needs Dask, so the program `sila` of the Python package has it.
void add_fleet(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("fleet", "Learn many places side by side on Dask (in the Python package).");
  verb->prefix_command();
  verb->callback(
      [] { throw std::invalid_argument("fleet: comes with the Python package; pip install 'sila[fleet]'"); });
}

}  // namespace sila::cli
