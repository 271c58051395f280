#include "core/kinematics.hpp"

#include <algorithm>
#include <cmath>

#include "core/concatenate.hpp"

namespace sila {

void require_sample(const char* function, const Trajectory& track, std::size_t last) {
  const std::size_t count = std::min(track.times_s.size(), track.positions_m.size());
  if (last >= count)
    throw invalid_argument(function, ": last = ", last, ", must be below ", count, ", the number of samples of track '",
                           track.id, "'");
}

Vector2 mean_velocity(const CurbTrajectory& observed, double window_s) {
  const std::size_t samples = observed.positions.size();
  if (samples == 0) throw invalid_argument("mean_velocity: the observed track is empty");
  if (samples == 1) return observed.velocities.back();
  const double interval_s = observed.times_s[1] - observed.times_s[0];
  const auto back = std::clamp<long>(std::lround(window_s / interval_s), 1, static_cast<long>(samples) - 1);
  const std::size_t from = samples - 1 - static_cast<std::size_t>(back);
  return (observed.positions.back() - observed.positions[from]) / (observed.times_s.back() - observed.times_s[from]);
}

Vector2 mean_velocity_mps(const CurbTrajectory& observed, double window_s) {
  return velocity_to_world(observed.frame, mean_velocity(observed, window_s));
}

std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s) {
  if (past_m.empty()) throw invalid_argument("constant_velocity: past_m is empty, must have a position");
  const auto back =
      std::clamp<long>(std::lround(kConstantVelocityWindow_s / interval_s), 0, static_cast<long>(past_m.size()) - 1);
  const Vector2 way_m = past_m.back() - past_m[past_m.size() - 1 - static_cast<std::size_t>(back)];
  const Vector2 velocity_mps = back > 0 ? Vector2(way_m / (static_cast<double>(back) * interval_s)) : way_m;
  std::vector<Vector2> path_m;
  for (int j = 1; j <= steps; ++j) path_m.push_back(past_m.back() + j * interval_s * velocity_mps);
  return path_m;
}

double mean_speed_mps(const CurbTrajectory& observed) {
  double sum = 0.0;
  for (const Vector2& velocity : observed.velocities) sum += velocity_to_world(observed.frame, velocity).norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, observed.velocities.size()));
}

}  // namespace sila
