#pragma once

#include <cstddef>
#include <span>

namespace sila {

/// The stated probability that a person changes their motion until a horizon, and whether they did.
struct ChangeForecast {
  double probability = 0.0;
  bool changed = false;
};

/// How stated probabilities of starting (kStanding) or stopping (kWalking) agree with what happened.
struct ChangeScore {
  std::size_t motion_state = 0;
  double horizon_s = 0.0;
  std::size_t windows = 0;
  double rate = 0.0;               ///< share that changed
  double brier = 0.0;              ///< mean squared error of the probabilities (Brier 1950)
  double base_brier = 0.0;         ///< the same of `rate`, which is fitted to these very windows
  double calibration_error = 0.0;  ///< expected, over ten bins of equal width (Naeini et al. 2015)
};

/// Precondition: not empty.
ChangeScore score_changes(std::size_t motion_state, double horizon_s, std::span<const ChangeForecast> forecasts);

}  // namespace sila
