#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "sila/core/clean.hpp"
#include "sila/io/scene.hpp"

namespace sila {

/// A file (or folder) of tracks, how to read it, and how its positions become the scene's.
struct TrackSource {
  std::filesystem::path path;
  ReadOptions options;
  SimilarityTransform to_scene;
};

/// The files named; without paths, those of the scene. One that is (or is named like) an entry of the scene's `files`
/// gets its settings; fields set in `options` win. Throws: FormatError if there is none, or one of the scene is in none
/// of the folders searched.
std::vector<TrackSource> sources_of(std::span<const std::filesystem::path> paths, const Scene& scene,
                                    const ReadOptions& options);

/// The rows of the source in the frame of the scene.
Detections in_scene(Detections detections, const SimilarityTransform& to_scene);

/// Throws: FormatError for a file in pixels without a camera or a scale.
void require_metres(bool pixels, const TrackSource& source);

/// All rows of the source in the frame of the scene. Throws: as read_detections and require_metres.
Detections rows_of(const TrackSource& source);

/// Throws: FormatError with the counts of dropped rows, if they made no track.
void require_tracks(const TrackReport& report, const std::string& source);

/// As read_scene, for the JSON of a file.
Scene scene_of_json(const std::filesystem::path& path, const nlohmann::json& json, CurbScaling scaling,
                    const std::filesystem::path& data_dir);

/// As read_camera, for the JSON of a camera. `where`: the path of the object inside the file, such as "camera.".
CameraFile camera_of_json(const std::string& file, const nlohmann::json& json, const std::string& where);

}  // namespace sila
