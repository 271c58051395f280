#pragma once

#include <CLI/CLI.hpp>

namespace sila::cli {

/// Adds a verb to the program; what it does runs from its callback.
using AddVerb = void(CLI::App& app);
AddVerb add_simulate, add_learn, add_predict, add_evaluate, add_fuse, add_prior, add_fleet, add_inspect, add_log,
    add_rollback, add_diff, add_verify, add_experiment, add_report, add_scene, add_serve, add_replay, add_config;
/// Every verb, in the order of `sila --help`.
inline constexpr AddVerb* kVerbs[] = {add_simulate,   add_learn,   add_predict, add_evaluate, add_fuse,   add_prior,
                                      add_fleet,      add_inspect, add_log,     add_rollback, add_diff,   add_verify,
                                      add_experiment, add_report,  add_scene,   add_serve,    add_replay, add_config};

}  // namespace sila::cli
