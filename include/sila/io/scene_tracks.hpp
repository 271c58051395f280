#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "sila/core/clean.hpp"
#include "sila/io/scene.hpp"

namespace sila {

/// The tracks of all `files` of a scene, in the scene's frame.
/// Throws: FormatError for an unreadable file, a scene without files, or if not one trajectory is left.
CleanTracks read_scene_tracks(const Scene& scene, const CleanConfig& config);

/// The tracks of the files named, in the scene's frame. A file that is (or is named like) an entry of the scene's
/// `files` gets that entry's `to_scene` and options; fields set in `options` win. Throws: as above;
/// std::invalid_argument for no path.
CleanTracks read_tracks(std::span<const std::filesystem::path> paths, const Scene& scene, const ReadOptions& options,
                        const CleanConfig& config);

/// The entry of the scene's `files` that a path means: the same file, else the one whose path agrees on the most
/// trailing components (at least the file name). Null if there is none, or several equally good ones with different
/// settings.
const SceneFile* matching_entry(const Scene& scene, const std::filesystem::path& path);

}  // namespace sila
