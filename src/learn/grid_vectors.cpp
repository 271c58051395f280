#include <cmath>
#include <map>

#include "learn/dictionary.hpp"

namespace sila {
namespace {

/// A mean heading shorter than this means that the person looped or turned about inside the cell.
constexpr double kShortestMeanHeading = 0.3;
/// No pedestrian passed through the cells between two positions that are farther apart than this speed allows.
constexpr double kFastest_mps = 100.0;

struct HeadingSum {
  Vector2 sum = Vector2::Zero();
  int samples = 0;
  std::size_t order = 0;
};

}  // namespace

GridVector to_grid_vector(const CurbTrajectory& track, const Grid& grid, double min_speed_mps) {
  std::map<CellKey, HeadingSum> cells;
  const auto add = [&](const Vector2& position, const Vector2& heading) {
    HeadingSum& cell =
        cells.try_emplace(cell_of(grid, position), HeadingSum{Vector2::Zero(), 0, cells.size()}).first->second;
    cell.sum += heading;
    cell.samples += 1;
  };
  for (std::size_t t = 0; t < track.positions.size(); ++t) {
    const Vector2& velocity = track.velocities[t];
    const double speed_mps = velocity_to_world(track.frame, velocity).norm();
    if (speed_mps < min_speed_mps || velocity.norm() == 0.0) continue;
    const Vector2 heading = velocity.normalized();
    add(track.positions[t], heading);
    if (t + 1 == track.positions.size()) continue;
    const Vector2 step = track.positions[t + 1] - track.positions[t];
    const double step_m = velocity_to_world(track.frame, step).norm();
    if (step_m > kFastest_mps * (track.times_s[t + 1] - track.times_s[t])) continue;
    const int parts = static_cast<int>(std::min(1000.0, std::ceil(step.norm() / (0.5 * grid.cell))));
    for (int k = 1; k < parts; ++k) add(track.positions[t] + step * k / parts, heading);
  }
  GridVector vector{std::vector<CellKey>(cells.size()), std::vector<Vector2>(cells.size(), Vector2::Zero())};
  for (const auto& [key, cell] : cells) {
    const Vector2 mean = cell.sum / cell.samples;
    vector.path[cell.order] = key;
    if (mean.norm() >= kShortestMeanHeading) vector.directions[cell.order] = mean.normalized();
  }
  return vector;
}

}  // namespace sila
