#include "sila/core/errors.hpp"

namespace sila {
namespace {

/// The text that was found, for a message: cut, and without characters that would break the line or command a terminal.
std::string printable(std::string text) {
  constexpr std::size_t longest = 1000;
  if (text.size() > longest) text.replace(longest, std::string::npos, "...");
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

std::string message(const std::string& path, std::size_t line, const std::string& expected, const std::string& found) {
  const std::string place = line == 0 ? path : path + ":" + std::to_string(line);
  return place + ": expected " + printable(expected) + ", found " + printable(found);
}

}  // namespace

FormatError::FormatError(const std::string& path_, std::size_t line_, const std::string& expected_,
                         const std::string& found_)
    : std::runtime_error(message(path_, line_, expected_, found_)),
      path(path_),
      line(line_),
      expected(expected_),
      found(found_) {}

}  // namespace sila
