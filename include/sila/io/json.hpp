#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace sila {

/// The JSON of a file; comments (// and /* */) are skipped, so that a file can say why.
/// Throws: FormatError, with the line, for a file that is missing, empty or not JSON.
nlohmann::json read_json(const std::filesystem::path& path);

}  // namespace sila
