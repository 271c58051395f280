#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace sila {

/// A number with its noun, as in "1 track" or "2 tracks".
std::string counted(std::integral auto number, std::string_view noun) {
  return std::to_string(number) + " " + std::string(noun) + (number == 1 ? "" : "s");
}

}  // namespace sila
