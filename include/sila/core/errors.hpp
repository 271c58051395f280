#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace sila {

// All errors of sila derive from std::exception, and what() is one sentence for people: std::invalid_argument for
// a mistake of the caller, and those below.

/// A file that cannot be used. The message names the file, the place in it, what was expected and what was
/// found.
class FormatError : public std::runtime_error {
 public:
  /// `line` is 1-based; 0 means that the whole file is meant.
  FormatError(const std::string& path, std::size_t line, const std::string& expected, const std::string& found);

  std::string path;
  std::size_t line = 0;
  std::string expected;
  std::string found;
};

/// A computation that failed after every documented remedy; the message has the sizes and the condition.
class NumericalError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace sila
