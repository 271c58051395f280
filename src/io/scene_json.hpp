#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "sila/io/scene.hpp"

namespace sila {

/// What read_scene makes of a file, of the JSON that is in it.
Scene scene_of_json(const std::filesystem::path& path, const nlohmann::json& json, CurbScaling scaling,
                    const std::filesystem::path& data_dir);

}  // namespace sila
