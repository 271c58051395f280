#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "options.hpp"
#include "sila/io/model_file.hpp"
#include "verbs.hpp"

namespace sila::cli {

void add_verify(CLI::App& app) {
  auto common = std::make_shared<CommonOptions>();
  auto path = std::make_shared<std::string>();
  CLI::App* verb = add_plain_verb(app, "verify", "Check every page, record and kept model of a file.",
                                  "sila verify corner.sila", *common);
  verb->add_option("model", *path, "model file")->required()->type_name("M.sila");
  verb->callback([common, path] {
    const VerifyReport report = ModelFile::open(*path).verify();
    if (common->json) {
      std::cout << nlohmann::ordered_json{{"model", *path},
                                          {"intact", true},
                                          {"pages", report.pages},
                                          {"episodes", report.episodes},
                                          {"undone", report.undone}}
                       .dump(2)
                << "\n";
    } else {
      std::cout << *path << ": intact; " << report.pages << " pages, " << report.episodes << " recorded episodes, "
                << report.undone << " of which can be undone\n";
    }
  });
}

}  // namespace sila::cli
