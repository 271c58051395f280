#pragma once

#include <dlib/general_hash/murmur_hash3.h>

#include <array>
#include <cstdint>
#include <string>

namespace sila {

/// MurmurHash3 of 128 bits, high half first; the same on every machine. It distinguishes different content, not content
/// that was made to have the same hash.
inline std::array<std::uint64_t, 2> hash_of(const std::string& bytes) {
  const auto [high, low] = dlib::murmur_hash3_128bit(bytes.data(), static_cast<int>(bytes.size()));
  return {high, low};
}

}  // namespace sila
