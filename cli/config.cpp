#include "options.hpp"

namespace sila::cli {
namespace {

struct ConfigVerb {
  CommonOptions common;
};

void print_config(const ConfigVerb& verb) {
  const Config config = configured(verb.common);
  print(verb.common, to_json(config), table(list_fields(config)));
}

}  // namespace

void add_config(CLI::App& app) {
  add_verb(app,
           {"config", "Print every configuration value with its unit, range and meaning.",
            "sila config --set predict.horizon_s=3"},
           Shared::both, print_config);
}

}  // namespace sila::cli
