#include "text_blocks.hpp"

#include <algorithm>
#include <stdexcept>

#include "sila/core/errors.hpp"

namespace sila {

TextBlocks::TextBlocks(const std::filesystem::path& path, std::size_t block_bytes)
    : path_(path.string()), file_(path_), block_bytes_(block_bytes) {}

std::optional<TextBlock> TextBlocks::read(std::size_t index) {
  if (index >= places_.size()) throw std::logic_error("TextBlocks: a block was left out");
  const BlockStart place = places_[index];
  file_.seek(place.offset);
  TextBlock block{std::string(block_bytes_, '\0'), place.line};
  block.text.resize(file_.read(block.text));
  if (block.text.empty()) return std::nullopt;
  if (block.text.size() == block_bytes_) {
    const std::size_t end = block.text.rfind('\n');
    if (end == std::string::npos) {
      throw FormatError(path_, place.line, "lines of less than " + std::to_string(block_bytes_) + " bytes",
                        "a longer one");
    }
    block.text.resize(end + 1);
  }
  reject_binary(path_, block.text);
  if (index + 1 == places_.size()) {
    const auto lines = static_cast<std::size_t>(std::ranges::count(block.text, '\n'));
    places_.push_back({place.offset + block.text.size(), place.line + lines});
  }
  if (place.offset == 0 && block.text.starts_with(kByteOrderMark)) block.text.erase(0, kByteOrderMark.size());
  return block;
}

}  // namespace sila
