#pragma once

#include <cstddef>
#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// How a mode differs from what is expected of its roll-out.
enum class VariantKind { expected, slower, faster, left, right, wide };
inline constexpr const char* kVariantKinds[] = {"expected", "slower", "faster", "left", "right", "wide"};

/// One hypothesis of what the person will do, in the world frame.
struct Mode {
  double weight = 0.0;
  std::vector<Vector2> path_m;          ///< mean position at each time of the prediction
  std::vector<Matrix2> covariances_m2;  ///< of the position, same length
  std::vector<int> primitives;          ///< visited, in order; empty for constant velocity
  VariantKind variant = VariantKind::expected;
  std::size_t source = 0;  ///< which of the merged roll-outs it comes from, heaviest first
};

/// Where the person will be with a nominal probability: wherever the density of the modes is at least exp(-level) of
/// its peak (`nonconformity` at most `level`, regions.hpp). The levels were learnt from past errors.
struct Region {
  double probability = 0.0;
  std::vector<double> levels;  ///< at each time of the prediction
};

/// Invariant: at least one mode; weights >= 0, sum 1, in falling order; every path as long as `times_s`.
struct Prediction {
  double t0_s = 0.0;            ///< time of the last observed sample, on the clock of the input
  std::vector<double> times_s;  ///< after t0
  std::vector<Mode> modes;
  std::vector<Region> regions;  ///< by rising probability
  bool fallback = false;        ///< no transition matched: kinematics alone
  double novelty = 0.0;     ///< in [0, 1]: share of the people seen so far whose path was better known than this one
  double observed_s = 0.0;  ///< between the first and the last sample that it rests on
  bool standing = false;    ///< mean speed below 0.3 m/s while observed
  /// Probability that the motion has changed by each time: that a standing person has started (is 0.5 m away), that a
  /// walking one has stopped (slower than 0.3 m/s over 0.8 s). Empty before errors are known.
  std::vector<double> change_probabilities;
};

}  // namespace sila
