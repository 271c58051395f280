#include <nlohmann/json.hpp>

#include "sila/io/model_file.hpp"
#include "sila/refine/prune.hpp"

namespace sila {

StoredModel stored_prior(std::span<const StoredModel> models) {
  std::vector<Model> contents;
  for (const StoredModel& stored : models) contents.push_back(stored.model);
  StoredModel prior;
  prior.model = make_prior(contents);
  auto configuration = nlohmann::ordered_json::parse(models.front().configuration);
  configuration.erase("metres_per_pixel");  // each place measures its own
  prior.configuration = configuration.dump();
  return prior;
}

}  // namespace sila
