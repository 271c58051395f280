#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

namespace sila {

/// A file that is written in one step: the content goes to a temporary file beside the target, and `commit` replaces
/// the target by it. A reader of the target sees the old content or the whole new one; without a
/// `commit` nothing changes. A target that is no regular file (a pipe, /dev/stdout) cannot be replaced and is written
/// to directly.
class OutputFile {
 public:
  /// Throws: FormatError if the path cannot be written: a folder, a folder that does not exist, no permission.
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  std::ostream& stream() { return stream_; }

  /// Throws: FormatError if something could not be written, for instance on a full disk; the target does not change
  /// then.
  void commit();

 private:
  std::filesystem::path target_;    ///< as the caller named it
  std::filesystem::path written_;   ///< where the bytes go first
  std::filesystem::path replaced_;  ///< the regular file to replace, symbolic links resolved; empty: written directly
  std::ofstream stream_;
};

/// Writes a whole file in one step, as OutputFile does.
void write_file(const std::filesystem::path& path, std::string_view content);

/// The JSON of a file; comments (// and /* */) are skipped.
/// Throws: FormatError, with the line, for a file that is missing, empty or not JSON.
nlohmann::json read_json(const std::filesystem::path& path);

}  // namespace sila
