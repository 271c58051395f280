#pragma once

#include <nlohmann/json.hpp>

#include "sila/io/scene.hpp"

namespace sila {

/// As read_scene, for the JSON of a file.
Scene scene_of_json(const std::filesystem::path& path, const nlohmann::json& json,
                    const std::filesystem::path& data_dir);

}  // namespace sila
