#pragma once

#include <nlohmann/json_fwd.hpp>

#include "sila/train/change.hpp"

namespace sila {

/// The change as a model file keeps it: the shapes of the primitives that are new or fused, and the transitions whose
/// count is another one. Constant in the size of the model, but for what changed.
/// Shapes: `cells` is x, y and direction [whole degrees] of each cell, one after the other.
nlohmann::ordered_json to_json(const ModelChange& change, const Model& previous, const Model& updated);

}  // namespace sila
