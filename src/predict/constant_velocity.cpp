#include "predict/constant_velocity.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/kinematics.hpp"

namespace sila {

std::vector<Vector2> constant_velocity(std::span<const Vector2> past_m, int steps, double interval_s) {
  if (past_m.empty()) throw std::invalid_argument("constant_velocity: past_m is empty, must have a position");
  const auto back =
      std::clamp<long>(std::lround(kConstantVelocityWindow_s / interval_s), 0, static_cast<long>(past_m.size()) - 1);
  const Vector2 way_m = past_m.back() - past_m[past_m.size() - 1 - static_cast<std::size_t>(back)];
  const Vector2 velocity_mps = back > 0 ? Vector2(way_m / (static_cast<double>(back) * interval_s)) : way_m;
  std::vector<Vector2> path_m;
  for (int j = 1; j <= steps; ++j) path_m.push_back(past_m.back() + j * interval_s * velocity_mps);
  return path_m;
}

}  // namespace sila
