#pragma once

#include <cstddef>
#include <vector>

#include "random.hpp"
#include "sila/sim/simulate.hpp"

namespace sila::sim {

/// One track as reported, and what was true: `seen` counts samples of the walker.
struct Sighting {
  std::size_t first = 0;  ///< true samples [first, last] of the walker
  std::size_t last = 0;
  std::vector<std::size_t> seen;
  std::vector<Vector2> measured_m;
};

/// What a tracker reports of one walker: the stay in view, perhaps cut or under two ids, with gaps and noise.
std::vector<Sighting> track_walker(const std::vector<Vector2>& samples_m, const IntersectionScene& scene,
                                   const SimulationConfig& config, Random& random);

}  // namespace sila::sim
