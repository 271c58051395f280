#pragma once

#include <CLI/CLI.hpp>
#include <stdexcept>

namespace sila::cli {

/// A wrong command line, whatever the files contain: exit code 2.
struct UsageError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};
/// The result of a function that only checks options: what it rejects is a wrong command line.
auto of_options(const auto& function) {
  try {
    return function();
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// Adds a verb to the program; what it does runs from its callback.
using AddVerb = void(CLI::App& app);
AddVerb add_simulate, add_learn, add_predict, add_evaluate, add_fuse, add_prior, add_fleet, add_inspect, add_log,
    add_rollback, add_diff, add_verify, add_experiment, add_report, add_scene, add_serve, add_replay, add_config;
/// Every verb, in the order of `sila --help`.
inline constexpr AddVerb* kVerbs[] = {add_simulate,   add_learn,   add_predict, add_evaluate, add_fuse,   add_prior,
                                      add_fleet,      add_inspect, add_log,     add_rollback, add_diff,   add_verify,
                                      add_experiment, add_report,  add_scene,   add_serve,    add_replay, add_config};

}  // namespace sila::cli
