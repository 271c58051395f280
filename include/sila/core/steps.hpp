#pragma once

#include <algorithm>
#include <cmath>

namespace sila {

/// How many steps of an interval a horizon has: none beyond the horizon, and at least one. Prediction and evaluation
/// must agree on it, also where the horizon is no multiple of the interval (5 s at 0.3 s: 16 steps).
/// Precondition: both are positive.
inline int steps_in(double horizon_s, double interval_s) {
  constexpr double rounding = 1e-9;  // 2.4 / 0.2 must not be 11
  return std::max(1, static_cast<int>(std::floor(horizon_s / interval_s + rounding)));
}

}  // namespace sila
