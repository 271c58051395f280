#pragma once

#include <sstream>
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

}  // namespace sila
