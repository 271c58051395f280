
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "sila/core/errors.hpp"
#include "sila/version.hpp"
#include "verbs.hpp"

namespace {

constexpr int kBadInput = 1;
constexpr int kUsage = 2;

int fail(int code, const std::exception& error) {
  std::cerr << "sila: " << error.what() << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Learns how pedestrians move at intersections, batch by batch, and predicts their next seconds.",
               "sila");
  app.set_version_flag("--version", "sila " SILA_VERSION);
  app.require_subcommand(0, 1);  // an unknown verb is told by its name; a missing one below
  app.footer("`sila VERB --help` has an example of each verb.");
  sila::cli::add_simulate(app);
  sila::cli::add_learn(app);
  sila::cli::add_predict(app);
  sila::cli::add_evaluate(app);
  sila::cli::add_fuse(app);
  sila::cli::add_fleet(app);
  sila::cli::add_inspect(app);
  sila::cli::add_log(app);
  sila::cli::add_rollback(app);
  sila::cli::add_diff(app);
  sila::cli::add_verify(app);
  sila::cli::add_experiment(app);
  sila::cli::add_report(app);
  sila::cli::add_scene(app);
  sila::cli::add_serve(app);
  sila::cli::add_replay(app);
  sila::cli::add_config(app);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) throw CLI::RequiredError("A verb");
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    app.exit(error, std::cout, std::cerr);
    return kUsage;
  } catch (const sila::FormatError& error) {
    return fail(kBadInput, error);
  } catch (const std::invalid_argument& error) {
    return fail(kUsage, error);
  } catch (const std::exception& error) {
    return fail(kBadInput, error);
  }
  return 0;
}
