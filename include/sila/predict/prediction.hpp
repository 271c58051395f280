#pragma once

#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// One hypothesis of what the person will do, in the world frame.
struct Mode {
  double weight = 0.0;
  std::vector<Vector2> path_m;          ///< mean position at each time of the prediction
  std::vector<Matrix2> covariances_m2;  ///< of the position, same length
  std::vector<int> primitives;          ///< visited, in order; empty for constant velocity
};

/// Invariant: at least one mode; weights >= 0, sum 1, in falling order; every path as long as `times_s`.
struct Prediction {
  double t0_s = 0.0;            ///< time of the last observed sample, on the clock of the input
  std::vector<double> times_s;  ///< after t0
  std::vector<Mode> modes;
  bool fallback = false;  ///< no transition matched: kinematics alone
  double novelty = 0.0;   ///< in [0, 1]: how little of the observed path any field knows
};

}  // namespace sila
