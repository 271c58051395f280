#pragma once

#include <algorithm>

#include "sila/core/clean.hpp"

namespace sila {

/// Jitter of time stamps, as a share of the interval between samples.
inline constexpr double kStampJitter = 0.2;
/// Frame numbers become seconds with rounding: a gap of exactly the limit is none, and stamps nearer than this are one.
inline constexpr double kSlack_s = 1e-6;

/// The longest gap that does not cut a track [s], from the interval before it; without one, pass `max_gap_s`. Stamps
/// jitter; without an allowance for that, a tracker at 1 Hz would be cut at every second sample. The allowance depends
/// on earlier samples alone, so that a stream is cut as a file is.
inline double longest_gap_s(double interval_s, const CleanConfig& config) {
  return config.max_gap_s + kStampJitter * std::min(interval_s, config.max_gap_s) + kSlack_s;
}

/// Whether a displacement in a time is faster than a pedestrian: the id belongs to another person, or it is an outlier.
inline bool is_jump(const Vector2& displacement_m, double time_s, const CleanConfig& config) {
  return displacement_m.norm() > config.jump_tolerance_m + config.max_speed_mps * time_s;
}

}  // namespace sila
