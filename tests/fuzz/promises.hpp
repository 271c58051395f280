#pragma once

// What every fuzz target holds a reader to.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "sila/core/errors.hpp"

namespace sila::fuzz {

/// Ends the run, and so keeps the input, if a promise was broken.
inline void require(bool kept, std::string_view promise, std::string_view detail = {}) {
  if (kept) return;
  std::fprintf(stderr, "fuzz: broken promise: %.*s\n%.*s\n", static_cast<int>(promise.size()), promise.data(),
               static_cast<int>(detail.size()), detail.data());
  std::abort();
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

inline std::size_t lines_in(std::string_view text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1;
}

/// A rejection names the file, a line that it has (0: the whole file), what was expected and what was found.
inline void require_good_rejection(const FormatError& error, const std::string& path, std::size_t lines) {
  const std::string_view message = error.what();
  require(message.starts_with(path) && error.path.starts_with(path), "the file is named", message);
  require(error.line <= lines, "the line is in the file", message);
  require(!error.expected.empty() && !error.found.empty(), "what was expected and found is said", message);
  const auto commands = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  require(std::ranges::none_of(message, commands), "one line says it, and commands no terminal", message);
  require(message.size() < 2200, "it is said in about 2 KB", message);
}

/// Whether the input was taken. Any other error than a FormatError ends the run.
template <class Action>
bool accepts(const std::string& path, std::size_t lines, Action&& action) {
  try {
    action();
    return true;
  } catch (const FormatError& error) {
    require_good_rejection(error, path, lines);
    return false;
  }
}

}  // namespace sila::fuzz
