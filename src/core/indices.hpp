#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace sila {

/// 0, 1, ... below `count`.
template <class Index = std::size_t>
std::vector<Index> indices(std::size_t count) {
  std::vector<Index> all(count);
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

/// For each index below `size` its position in `kept`; -1 if it is not there. Throws: std::out_of_range.
inline std::vector<int> inverse_of(const std::vector<int>& kept, std::size_t size) {
  std::vector<int> positions(size, -1);
  for (std::size_t k = 0; k < kept.size(); ++k) positions.at(static_cast<std::size_t>(kept[k])) = static_cast<int>(k);
  return positions;
}

}  // namespace sila
