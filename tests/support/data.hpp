#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace sila::testing {

/// The folder of the recorded tracks, if this machine has it: SILA_DATA_DIR, else shared/data beside the checkout or a
/// folder above. They are not part of the project; tests that need them are skipped without.
inline std::optional<std::filesystem::path> recordings() {
  std::error_code unknown;
  if (const char* given = std::getenv("SILA_DATA_DIR")) return std::filesystem::path(given);
  const auto repository = std::filesystem::path(SILA_TESTS_DIR).parent_path();
  for (const auto& base : {repository.parent_path(), repository.parent_path().parent_path()}) {
    if (std::filesystem::exists(base / "shared/data/scenes", unknown)) return base / "shared/data";
  }
  return std::nullopt;
}

}  // namespace sila::testing
