#include "sila/core/errors.hpp"

namespace sila {
namespace {

std::string message(const std::string& path, std::size_t line, const std::string& expected, const std::string& found) {
  const std::string place = line == 0 ? path : path + ":" + std::to_string(line);
  return place + ": expected " + expected + ", found " + found;
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
