#include "sila/io/scene.hpp"

#include <iostream>
#include <memory>

#include "sila/io/model_file.hpp"
#include "verbs.hpp"

namespace sila::cli {

void add_scene(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("scene", "Scene files: where a place has its corners.");
  verb->require_subcommand(1);
  CLI::App* show = verb->add_subcommand("show", "Print the frames of a model as a scene file.");
  show->footer("Example:\n  sila scene show corner.sila > corner.json");
  auto model = std::make_shared<std::string>();
  show->add_option("model", *model, "model file")->required()->type_name("M.sila");
  show->callback([model] { std::cout << to_text(scene_of(load_model(*model).model)); });
}

}  // namespace sila::cli
