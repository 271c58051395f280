#include <iostream>
#include <memory>

#include "options.hpp"
#include "sila/io/config_json.hpp"
#include "verbs.hpp"

namespace sila::cli {

void add_config(CLI::App& app) {
  auto common = std::make_shared<CommonOptions>();
  CLI::App* verb = add_verb(app, "config", "Print every configuration value with its unit, range and meaning.",
                            "sila config --set predict.horizon_s=3", *common);
  verb->callback([common] {
    const Config config = configured(*common);
    if (common->json)
      std::cout << to_json(config).dump(2) << "\n";
    else
      std::cout << table(list_fields(config));
  });
}

}  // namespace sila::cli
