#pragma once

#include <CLI/CLI.hpp>

namespace sila::cli {

// One function a verb: adds it to the program; what it does runs from its callback.
void add_simulate(CLI::App& app);
void add_learn(CLI::App& app);
void add_predict(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_fuse(CLI::App& app);
void add_prior(CLI::App& app);
void add_fleet(CLI::App& app);
void add_inspect(CLI::App& app);
void add_log(CLI::App& app);
void add_rollback(CLI::App& app);
void add_diff(CLI::App& app);
void add_verify(CLI::App& app);
void add_experiment(CLI::App& app);
void add_report(CLI::App& app);
void add_scene(CLI::App& app);
void add_serve(CLI::App& app);
void add_replay(CLI::App& app);
void add_config(CLI::App& app);

}  // namespace sila::cli
