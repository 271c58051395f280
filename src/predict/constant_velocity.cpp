#include "sila/predict/constant_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sila {

Vector2 mean_velocity_mps(const CurbTrajectory& observed, double window_s) {
  const std::size_t samples = observed.positions.size();
  if (samples == 0) throw std::invalid_argument("mean_velocity_mps: the observed track is empty");
  if (samples == 1) return velocity_to_world(observed.frame, observed.velocities.back());
  const double interval_s = observed.times_s[1] - observed.times_s[0];
  const auto back = std::clamp<long>(std::lround(window_s / interval_s), 1, static_cast<long>(samples) - 1);
  const std::size_t from = samples - 1 - static_cast<std::size_t>(back);
  return velocity_to_world(observed.frame, observed.positions.back() - observed.positions[from]) /
         (observed.times_s.back() - observed.times_s[from]);
}

std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s, double window_s) {
  const Vector2 velocity_mps = mean_velocity_mps(observed, window_s);
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  std::vector<Vector2> path_m;
  for (int j = 1; j <= steps; ++j) path_m.push_back(start_m + j * interval_s * velocity_mps);
  return path_m;
}

double mean_speed_mps(const CurbTrajectory& observed) {
  double sum = 0.0;
  for (const Vector2& velocity : observed.velocities) sum += velocity_to_world(observed.frame, velocity).norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, observed.velocities.size()));
}

}  // namespace sila
