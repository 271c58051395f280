#pragma once

#include <cstddef>
#include <iterator>
#include <optional>

namespace sila {

/// Number of speed classes that have separate error statistics.
inline constexpr int kSpeedClasses = 5;
/// Mean observed speeds between the classes [m/s]: standing, strolling, slow, normal, fast.
inline constexpr double kSpeedClassLimits_mps[] = {0.3, 0.8, 1.15, 1.5};
static_assert(std::size(kSpeedClassLimits_mps) + 1 == kSpeedClasses);
/// A person moves if the first and the last observed position are at least this far apart [m].
inline constexpr double kMoving_m = 0.5;
/// People who stand (the slowest speed class) have error densities of their own: their errors are much smaller than
/// those of people who walk.
inline constexpr std::size_t kWalking = 0, kStanding = 1, kMotionStates = 2;
/// Classes of windows by the observed time. Class 0 is the whole window; class i > 0 has at least the time i - 1 of
/// this list. The last class also has all shorter windows.
inline constexpr double kShorterObserved_s[] = {1.6, 0.8, 0.4};
inline constexpr std::size_t kObservedClasses = 1 + std::size(kShorterObserved_s);
inline constexpr std::size_t kErrorDensities = kObservedClasses * kMotionStates;
/// Nonconformity scores are kept for each speed class and, where less was observed, for each motion state.
inline constexpr int kScoreClasses = kSpeedClasses + static_cast<int>((kObservedClasses - 1) * kMotionStates);
/// kStanding for the slowest speed class.
constexpr std::size_t motion_state(int speed_class) {
  return speed_class == 0 ? kStanding : kWalking;
}

/// Classes of people who hardly move, by the speed of their net displacement while observed. The last class is that of
/// people who walked, but moved more slowly than the last limit in the last 0.8 s.
inline constexpr double kSlowLimits_mps[] = {0.05, 0.17};
inline constexpr std::size_t kStopped = std::size(kSlowLimits_mps), kSlowClasses = kStopped + 1;

/// The classes that error statistics are kept for (`person_class` in src/refine/stacking.hpp).
struct PersonClass {
  int speed = 0;                    ///< see kSpeedClassLimits_mps
  std::optional<std::size_t> slow;  ///< see kSlowLimits_mps
  std::size_t observed = 0;         ///< see kShorterObserved_s

  /// Includes people who have stopped.
  bool walks() const { return motion_state(speed) == kWalking; }
  /// In the whole window: excludes people who have stopped.
  bool hardly_moved() const { return slow && slow != kStopped; }
  /// The errors of people who have stopped are like those of people who stand.
  std::size_t error_state() const { return slow == kStopped ? kStanding : motion_state(speed); }
  std::size_t density() const { return observed * kMotionStates + error_state(); }
  std::size_t score() const {
    if (observed > 0) return kSpeedClasses - kMotionStates + density();
    return error_state() == kStanding ? 0 : static_cast<std::size_t>(speed);
  }
};

}  // namespace sila
