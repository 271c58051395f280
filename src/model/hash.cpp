#include "model/hash.hpp"

#include <dlib/general_hash/murmur_hash3.h>

namespace sila {

std::array<std::uint64_t, 2> hash_of(const std::string& bytes) {
  const auto [high, low] = dlib::murmur_hash3_128bit(bytes.data(), static_cast<int>(bytes.size()));
  return {high, low};
}

}  // namespace sila
