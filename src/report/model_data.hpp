#pragma once

#include <nlohmann/json.hpp>

#include "sila/io/model_file.hpp"
#include "sila/io/scene.hpp"

// Parts of the data that the viewer shows (docs/viewer.md).

namespace sila {

/// Corners, frames and the direction of y.
nlohmann::ordered_json scene_json(const Scene& scene, const ModelSettings& settings);
/// The nine entries of the homography from image to ground, row by row.
nlohmann::ordered_json camera_json(const Camera& camera);
/// Adds the picture, a data URL, and the scene's camera, by which metres become its pixels; nothing for no picture.
void add_picture(nlohmann::ordered_json& data, const std::string& picture, const Scene& scene);
/// The paths of at most this number of tracks, evenly chosen, with a point each 0.4 s: x, y, x, y, ...
nlohmann::ordered_json tracks_json(std::span<const FramedTrajectory> tracks, std::size_t most);
/// Primitives with their cells, transitions with their counts.
nlohmann::ordered_json model_json(const Model& model);
/// The records of all episodes in the model file; without the shapes of the changes if they take more than
/// `most_bytes`.
nlohmann::ordered_json episodes_json(const StoredModel& stored, std::size_t most_bytes);

}  // namespace sila
