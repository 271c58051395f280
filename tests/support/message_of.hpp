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

/// For EXPECT_TRUE and EXPECT_FALSE: whether a text has a part; it is printed if that is not as expected.
inline ::testing::AssertionResult says(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  return ::testing::AssertionResult(found)
         << "\"" << text << (found ? "\" says \"" : "\" does not say \"") << part << "\"";
}

}  // namespace sila
