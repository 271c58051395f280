#pragma once

#include <stdexcept>

namespace sila::cli {

/// A wrong command line, whatever the files contain: exit code 2.
struct UsageError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};
/// The result of a function that only checks options: what it rejects is a wrong command line.
auto of_options(const auto& function) {
  try {
    return function();
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

}  // namespace sila::cli
