#pragma once

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

/// The error of a wrong argument; its message is the parts, see `concatenate`.
template <class... Parts>
std::invalid_argument invalid_argument(const Parts&... parts) {
  return std::invalid_argument(concatenate(parts...));
}

}  // namespace sila
