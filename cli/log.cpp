#include <iostream>
#include <memory>

#include "options.hpp"
#include "sila/io/reports.hpp"
#include "verbs.hpp"

namespace sila::cli {

void add_log(CLI::App& app) {
  auto common = std::make_shared<CommonOptions>();
  auto path = std::make_shared<std::string>();
  CLI::App* verb =
      add_plain_verb(app, "log", "List the episodes of a model and what each did.", "sila log corner.sila", *common);
  verb->add_option("model", *path, "model file")->required()->type_name("M.sila");
  verb->callback([common, path] {
    ModelFile file = ModelFile::open(*path);
    const StoredModel stored = file.read();
    const int oldest = file.oldest_rollback();
    if (common->json)
      std::cout << log_json(stored, oldest).dump(2) << "\n";
    else
      std::cout << describe_log(stored, oldest);
  });
}

}  // namespace sila::cli
