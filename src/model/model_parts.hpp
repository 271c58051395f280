#pragma once

#include <string>
#include <vector>

#include "sila/model/model.hpp"

namespace sila {

/// A model and its configuration as bytes, cut so that an episode leaves most parts as they are, wherever fusion puts
/// them. What the bytes of a part mean is known here and in sila/model/packing.hpp alone.
struct ModelParts {
  std::string head;  ///< counts, settings, frames of the sites, and from and to of each transition
  /// Configuration, prior, episode ids in groups; error statistics of each site; each primitive; each transition
  /// without from and to.
  std::vector<std::string> parts;

  bool operator==(const ModelParts&) const = default;
};

ModelParts parts_of(const Model& model, const std::string& configuration);

struct ModelContent {
  Model model;
  std::string configuration;
};

/// Throws: std::invalid_argument for bytes that make no model.
ModelContent content_of(const ModelParts& parts);

}  // namespace sila
