#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "text_file.hpp"

namespace sila {

/// Whole lines of a text file that follow each other.
struct TextBlock {
  std::string text;
  std::size_t first_line = 1;  ///< 1-based
};

/// A text file, gzipped or not, in blocks of whole lines, so that a file of any size is read with the memory of one
/// block. Blocks may be read again, in any order.
class TextBlocks {
 public:
  /// Throws: FormatError for a file that is missing, a folder or unreadable.
  TextBlocks(const std::filesystem::path& path, std::size_t block_bytes);

  /// Block `index`; null behind the last one. A block is known once all before it were read.
  /// Throws: FormatError for truncated bytes, bytes that are no text, or a line that is longer than a block.
  std::optional<TextBlock> read(std::size_t index);

 private:
  struct BlockStart {
    std::size_t offset = 0;
    std::size_t line = 1;
  };

  std::string path_;
  GzipFile file_;
  std::size_t block_bytes_;
  std::vector<BlockStart> places_{BlockStart{}};  ///< where each block begins, and where the next unread one does
};

}  // namespace sila
