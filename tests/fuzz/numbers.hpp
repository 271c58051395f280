#pragma once

// Numbers that mean trouble, and bytes that are numbers.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <span>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace sila::fuzz {

inline constexpr std::array<double, 32> kTrouble = {0.0,
                                                    -0.0,
                                                    1.0,
                                                    -1.0,
                                                    2.0,
                                                    3.0,
                                                    5.0,
                                                    7.0,
                                                    9.0,
                                                    28.0,
                                                    50.0,
                                                    0.2,
                                                    1e-300,
                                                    std::numeric_limits<double>::denorm_min(),
                                                    1e-9,
                                                    1e-3,
                                                    1e3,
                                                    1e6,
                                                    1e9,
                                                    1.0000000001e9,
                                                    2147483647.0,
                                                    2147483648.0,
                                                    4294967296.0,
                                                    9.0e15,
                                                    9.3e18,
                                                    1.9e19,
                                                    1e150,
                                                    1e300,
                                                    std::numeric_limits<double>::max(),
                                                    std::numeric_limits<double>::infinity(),
                                                    -std::numeric_limits<double>::infinity(),
                                                    std::numeric_limits<double>::quiet_NaN()};

inline std::vector<double> numbers_of(const std::uint8_t* data, std::size_t size) {
  std::vector<double> numbers(size / sizeof(double));
  if (!numbers.empty()) std::memcpy(numbers.data(), data, sizeof(double) * numbers.size());
  return numbers;
}

inline std::size_t put_numbers(std::span<const double> numbers, std::uint8_t* data, std::size_t max_size) {
  const std::size_t count = std::min(numbers.size(), max_size / sizeof(double));
  if (count > 0) std::memcpy(data, numbers.data(), sizeof(double) * count);
  return sizeof(double) * count;
}

/// One number made another, put in, taken out, or a stretch of them repeated.
inline void spoil(std::vector<double>& numbers, std::mt19937& random) {
  const double trouble = kTrouble[random() % kTrouble.size()];
  const auto at = [&] { return static_cast<std::ptrdiff_t>(random() % (numbers.size() + 1)); };
  const auto place = numbers.begin() + at();
  switch (random() % 6) {
    case 0:
      numbers.insert(place, trouble);
      break;
    case 1:
      if (place != numbers.end()) numbers.erase(place);
      break;
    case 2:
      if (place != numbers.end()) *place = -*place;
      break;
    case 3: {
      const std::vector<double> copy(place, numbers.begin() + std::max(place - numbers.begin(), at()));
      numbers.insert(numbers.begin() + at(), copy.begin(), copy.end());
      break;
    }
    default:
      if (place != numbers.end()) *place = trouble;
  }
}

}  // namespace sila::fuzz
