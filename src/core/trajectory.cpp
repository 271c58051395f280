#include "sila/core/trajectory.hpp"

#include <cmath>

#include "core/concatenate.hpp"

namespace sila {
namespace {

/// Beyond these, sums of squares overflow, and a double resolves no tenth of a millisecond.
constexpr double kFarthest = 1e12;
constexpr double kLongest_s = 1e6;

bool is_far(const Vector2& value) {
  return !(value.cwiseAbs().maxCoeff() <= kFarthest);
}

[[noreturn]] void reject(const std::string& id, std::size_t sample, const char* what) {
  throw invalid_argument("trajectory '", id, "', sample ", sample, ": ", what);
}

void check(const std::string& id, const std::vector<double>& times_s, const std::vector<Vector2>& positions) {
  if (times_s.empty()) reject(id, 0, "there is no sample");
  if (times_s.size() != positions.size()) reject(id, times_s.size(), "there are not as many positions as times");
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (!std::isfinite(times_s[i]) || !positions[i].allFinite()) reject(id, i, "time or position is not finite");
    if (std::abs(times_s[i]) > kFarthest || is_far(positions[i])) reject(id, i, "time or position is over 1e12");
    if (i > 0 && times_s[i] <= times_s[i - 1]) reject(id, i, "times do not increase");
  }
  if (times_s.back() - times_s.front() > kLongest_s) reject(id, times_s.size() - 1, "the track is longer than 1e6 s");
}

}  // namespace

void validate(const Trajectory& track) {
  check(track.id, track.times_s, track.positions_m);
}

void validate(const CurbTrajectory& track) {
  check(track.id, track.times_s, track.positions);
  validate(track.frame);
  if (track.velocities.size() != track.times_s.size())
    reject(track.id, track.velocities.size(), "there are not as many velocities as times");
  for (std::size_t i = 0; i < track.velocities.size(); ++i) {
    if (!track.velocities[i].allFinite() || is_far(track.velocities[i]))
      reject(track.id, i, "velocity is not finite, or over 1e12");
  }
  if (!track.companions_mps.allFinite() || is_far(track.companions_mps) || !std::isfinite(track.still_s))
    reject(track.id, track.times_s.size() - 1, "companions_mps or still_s is not finite, or over 1e12");
}

}  // namespace sila
