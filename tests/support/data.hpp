#pragma once

#include <cstdlib>
#include <filesystem>

namespace sila::testing {

/// Where the real tracks are, if they are on this machine: SILA_DATA_DIR, else shared/data beside the checkout. They
/// are not part of the project; tests that need them are skipped without.
inline std::filesystem::path data_dir() {
  if (const char* dir = std::getenv("SILA_DATA_DIR")) return dir;
  return std::filesystem::path(SILA_TESTS_DIR).parent_path().parent_path() / "shared" / "data";
}

}  // namespace sila::testing
