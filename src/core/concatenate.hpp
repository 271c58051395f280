#pragma once

#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace sila {

/// The parts one after another, as `operator<<` writes them: numbers with at most six significant digits.
template <class... Parts>
std::string concatenate(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return std::move(text).str();
}

/// The texts of a list with a separator between them; `text_of` gives the text of an entry.
template <class List, class TextOf = std::identity>
std::string joined(const List& list, const char* separator, const TextOf& text_of = {}) {
  std::string text;
  for (const auto& entry : list) text += (text.empty() ? "" : separator) + std::string(std::invoke(text_of, entry));
  return text;
}

/// The error of a wrong argument; its message is the parts, see `concatenate`.
template <class... Parts>
std::invalid_argument invalid_argument(const Parts&... parts) {
  return std::invalid_argument(concatenate(parts...));
}

}  // namespace sila
