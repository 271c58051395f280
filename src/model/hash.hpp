#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace sila {

/// MurmurHash3 of 128 bits, high half first; the same on every machine. It distinguishes different content, not content
/// that was made to have the same hash.
std::array<std::uint64_t, 2> hash_of(const std::string& bytes);

}  // namespace sila
