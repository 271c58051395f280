#pragma once

#include <nlohmann/json.hpp>

#include "sila/core/clean.hpp"
#include "sila/io/scene.hpp"

namespace sila {

/// The files named; without paths, those of the scene. One that is (or is named like) an entry of the scene's `files`
/// gets its settings; fields set in `options` win. All are `resolved`. Throws: FormatError if there is none, or one of
/// the scene is in none of the folders searched.
std::vector<SceneFile> sources_of(std::span<const std::filesystem::path> paths, const Scene& scene,
                                  const ReadOptions& options);

/// The rows of the source in the frame of the scene.
Detections in_scene(Detections detections, const SimilarityTransform& to_scene);

/// Throws: FormatError for a file in pixels without a camera or a scale.
void require_metres(bool pixels, const SceneFile& source);

/// All rows of the source in the frame of the scene. Throws: as read_detections and require_metres.
Detections rows_of(const SceneFile& source);

/// Throws: FormatError with the counts of dropped rows, if they made no track.
void require_tracks(const TrackReport& report, const std::string& source);

/// As read_scene, for the JSON of a file.
Scene scene_of_json(const std::filesystem::path& path, const nlohmann::json& json,
                    const std::filesystem::path& data_dir);

/// As read_camera, for the JSON of a camera. `where`: the path of the object inside the file, such as "camera.".
CameraFile camera_of_json(const std::string& file, const nlohmann::json& json, const std::string& where);

}  // namespace sila
