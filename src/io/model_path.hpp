#pragma once

#include <filesystem>

#include "sqlite.hpp"

// Faults of the path of a model file, each in one sentence with the remedy. Every `reject` throws a FormatError.
namespace sila {

[[noreturn]] void reject(const std::filesystem::path& path, const std::string& found);
[[noreturn]] void reject_write(const std::filesystem::path& path, const std::string& found);
/// Throws the meaning of an error of SQLite for a model file.
[[noreturn]] void reject(const std::filesystem::path& path, const sqlite::Error& error);

/// Whether this process may read, write or search (R_OK, W_OK, X_OK).
bool may(const std::filesystem::path& path, int what);
/// Of a path that need not exist.
std::filesystem::file_status status_of(const std::filesystem::path& path);

void require_regular(const std::filesystem::path& path, const std::filesystem::file_status& status);
/// SQLite would find out at the first commit; better before hours of learning.
void require_writable(const std::filesystem::path& path, const std::filesystem::file_status& status);

}  // namespace sila
