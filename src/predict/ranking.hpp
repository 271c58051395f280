#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "sila/predict/scratch.hpp"

namespace sila::detail {

struct Ranked {
  double score = 0.0;
  int transition = 0;
};

/// The `most` transitions with the highest scores (of equals the first), in the order of their indices.
inline std::span<const int> best_in_order(std::span<Ranked> ranked, std::size_t most, Scratch& scratch) {
  if (ranked.size() > most) {
    std::nth_element(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(most), ranked.end(),
                     [](const Ranked& a, const Ranked& b) {
                       return a.score != b.score ? a.score > b.score : a.transition < b.transition;
                     });
    ranked = ranked.first(most);
    std::ranges::sort(ranked, {}, &Ranked::transition);
  }
  const auto transitions = scratch.array<int>(ranked.size());
  std::ranges::transform(ranked, transitions.begin(), &Ranked::transition);
  return transitions;
}

}  // namespace sila::detail
