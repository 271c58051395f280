#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <zlib.h>

#include <filesystem>
#include <string>

#include "sila/core/errors.hpp"
#include "support/scratch.hpp"

namespace sila::tests {

/// Writes a gzipped file; its path.
inline std::filesystem::path write_gz(const std::filesystem::path& file, const std::string& text) {
  gzFile out = gzopen(file.c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  return file;
}

inline std::filesystem::path scenes_of_experiments() {
  return std::filesystem::path(SILA_TESTS_DIR).parent_path() / "experiments/scenes";
}

/// The error that `call` throws; fails the test if it throws none, and gives one without texts.
template <class Call>
FormatError format_error_of(Call&& call) {
  try {
    call();
  } catch (const FormatError& error) {
    return error;
  }
  ADD_FAILURE() << "no FormatError was thrown";
  return {"", 0, "", ""};
}

/// Runs statements as a foreign program would.
inline void run_sql(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
  sqlite3_close(database);
}

}  // namespace sila::tests
