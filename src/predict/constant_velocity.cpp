#include "predict/constant_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/kinematics.hpp"

namespace sila {
namespace {

std::vector<Vector2> straight_on(const Vector2& start_m, const Vector2& velocity_mps, int steps, double interval_s) {
  std::vector<Vector2> path_m;
  for (int j = 1; j <= steps; ++j) path_m.push_back(start_m + j * interval_s * velocity_mps);
  return path_m;
}

}  // namespace

std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s) {
  if (past_m.empty()) throw std::invalid_argument("constant_velocity: past_m is empty, must have a position");
  const auto back =
      std::clamp<long>(std::lround(kConstantVelocityWindow_s / interval_s), 0, static_cast<long>(past_m.size()) - 1);
  const Vector2 way_m = past_m.back() - past_m[past_m.size() - 1 - static_cast<std::size_t>(back)];
  const Vector2 velocity_mps = back > 0 ? Vector2(way_m / (static_cast<double>(back) * interval_s)) : way_m;
  return straight_on(past_m.back(), velocity_mps, steps, interval_s);
}

std::vector<Vector2> constant_velocity(const CurbTrajectory& observed, int steps, double interval_s) {
  return straight_on(to_world(observed.frame, observed.positions.back()),
                     mean_velocity_mps(observed, kConstantVelocityWindow_s), steps, interval_s);
}

}  // namespace sila
