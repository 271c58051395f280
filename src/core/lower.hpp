#pragma once

#include <string>
#include <string_view>

namespace sila {

/// With small letters for the letters A to Z, in every locale.
inline std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

}  // namespace sila
