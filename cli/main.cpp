#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "sila/version.hpp"
#include "verbs.hpp"

namespace {

constexpr int kBadInput = 1;
constexpr int kUsage = 2;

int fail(int code, const std::exception& error) {
  std::cerr << "sila: " << error.what() << "\n";
  return code;
}

/// An empty argument is most often a variable of the shell that is not set. Throws: UsageError.
void require_words(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] == '\0')
      throw sila::cli::UsageError("expected a value after " + std::string(argv[i - 1]) + ", found an empty one");
  }
}

/// Throws: UsageError if a verb, or one of a group of verbs, is expected and another word or none is found.
void require_verb(const CLI::App& program, int argc, char** argv) {
  const CLI::App* group = &program;
  for (int i = 1; i == argc || (i < argc && argv[i][0] != '-'); ++i) {
    const std::vector<const CLI::App*> verbs = group->get_subcommands([](const CLI::App*) { return true; });
    if (verbs.empty()) return;
    const auto found = i == argc ? verbs.end() : std::ranges::find(verbs, argv[i], &CLI::App::get_name);
    if (found == verbs.end()) {
      std::string names;
      for (const CLI::App* verb : verbs) names += (names.empty() ? "" : ", ") + verb->get_name();
      throw sila::cli::UsageError((group == &program
                                       ? "expected a verb (`sila --help` lists them)"
                                       : "expected a verb of `sila " + group->get_name() + "`: " + names) +
                                  "; found " + (i == argc ? "none" : argv[i]));
    }
    group = *found;
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file over the limit of the shell is an error of the write, as a full disk
  CLI::App app("Learns how pedestrians move at intersections, batch by batch, and predicts their next seconds.",
               "sila");
  app.set_version_flag("--version", "sila " + std::string(sila::build_version()));
  app.require_subcommand(1);
  app.option_defaults()->disable_flag_override();  // a flag takes no value
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return "sila: " + std::string(error.what()) + "; `sila VERB --help` lists the options\n";
  });
  app.footer(
      "`sila VERB --help` has an example of each verb.\n"
      "Exit codes: 0 done; 1 bad input: a file, or a model that does not fit; 2 a wrong command line.");
  for (sila::cli::AddVerb* add : sila::cli::kVerbs) add(app);
  try {
    require_words(argc, argv);
    require_verb(app, argc, argv);
    app.parse(argc, argv);
    if (!std::cout.flush()) throw std::runtime_error("not everything could be written to standard output");
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    const std::vector<std::string> unknown = app.remaining(true);
    const auto option = std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with('-'); });
    const bool misspelt = option != unknown.end();  // matters more than what is then missing
    app.exit(misspelt ? CLI::ExtrasError("sila", {*option}) : error, std::cout, std::cerr);
    return kUsage;
  } catch (const sila::cli::UsageError& error) {
    return fail(kUsage, error);
  } catch (const std::exception& error) {
    return fail(kBadInput, error);
  }
  return 0;
}
