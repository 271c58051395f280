#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/lower.hpp"

struct gzFile_s;  // of zlib

namespace sila {

/// A file, unzipped if it is gzipped, read in parts.
/// Throws: FormatError for one that is missing, a folder, unreadable or truncated.
class GzipFile {
 public:
  explicit GzipFile(std::string path);

  /// As many bytes as there is room for; fewer only at the end.
  std::size_t read(std::span<char> into);
  /// To an offset of the unzipped bytes; of a gzipped file all before it is unzipped again.
  void seek(std::size_t offset);

 private:
  std::string path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
};

inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Throws: FormatError for bytes that are no text.
void reject_binary(const std::string& path, std::string_view bytes);

/// The whole text of a file, unzipped if it is gzipped.
/// Throws: FormatError for a file that is missing, a folder, unreadable, truncated, empty (`content` was expected) or
/// binary.
std::string read_text(const std::filesystem::path& path, const std::string& content = "a file with rows");

/// The text that the bytes of a file are, without a byte order mark. Throws: FormatError for empty or binary ones.
std::string text_of_bytes(const std::string& path, std::string bytes, const std::string& content = "a file with rows");

struct TextLine {
  std::string_view text;   ///< without the line end
  std::size_t number = 0;  ///< 1-based
};

/// The lines that are not blank. They point into `text`.
std::vector<TextLine> lines_of(std::string_view text, std::size_t first_number = 1);

std::string_view trimmed(std::string_view text);

/// Cells between separators, trimmed, without enclosing quotes. `separator` ' ' means runs of spaces, tabs and commas.
/// A separator inside quotes does not separate.
std::vector<std::string_view> cells_of(std::string_view line, char separator);

/// An id or a class as UTF-8; one that is not valid is read as Latin-1.
std::string utf8_of(std::string_view id);

/// A number that fills the whole cell; in every locale the same. "nan" and "inf" are numbers here.
std::optional<double> number_of(std::string_view cell);

/// At most 60 printable characters in quotes, for messages.
std::string excerpt(std::string_view text);

/// The shortest text that reads back as the same double.
std::string exact(double value);

}  // namespace sila
