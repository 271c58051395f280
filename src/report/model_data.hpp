#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

#include "sila/io/model_file.hpp"
#include "sila/io/scene.hpp"

// Parts of the data that the viewer shows (docs/viewer.md).

namespace sila {

/// Corners, frames and the direction of y.
nlohmann::ordered_json scene_json(const Scene& scene, const ModelSettings& settings);
/// Primitives with their cells, transitions with their counts.
nlohmann::ordered_json model_json(const Model& model);
/// What the model file has of every episode; without the shapes of the changes if they take more than `most_bytes`.
nlohmann::ordered_json episodes_json(const StoredModel& stored, std::size_t most_bytes);

}  // namespace sila
