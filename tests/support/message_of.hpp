#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace sila {

/// The message of the error that an action throws; empty if it throws none of this kind.
template <class Error = std::invalid_argument, class Action>
std::string message_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// For EXPECT_TRUE: whether a message has a part, and what it is if not.
inline ::testing::AssertionResult says(const std::string& message, const std::string& part) {
  if (message.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "\"" << message << "\" does not say \"" << part << "\"";
}

}  // namespace sila
