#include <iostream>
#include <memory>

#include "options.hpp"
#include "sila/io/reports.hpp"
#include "verbs.hpp"

namespace sila::cli {

void add_inspect(CLI::App& app) {
  auto common = std::make_shared<CommonOptions>();
  auto path = std::make_shared<std::string>();
  CLI::App* verb =
      add_plain_verb(app, "inspect", "Print the contents of a model.", "sila inspect corner.sila", *common);
  verb->add_option("model", *path, "model file")->required()->type_name("M.sila");
  verb->callback([common, path] {
    const StoredModel stored = load_model(*path);
    if (common->json)
      std::cout << inspect_json(stored).dump(2) << "\n";
    else
      std::cout << describe(stored);
  });
}

}  // namespace sila::cli
