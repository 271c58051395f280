#include "sila/predict/constant_velocity.hpp"

#include "sila/core/kinematics.hpp"

namespace sila {

std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s, double window_s) {
  const Vector2 velocity_mps = mean_velocity_mps(observed, window_s);
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  std::vector<Vector2> path_m;
  for (int j = 1; j <= steps; ++j) path_m.push_back(start_m + j * interval_s * velocity_mps);
  return path_m;
}

}  // namespace sila
