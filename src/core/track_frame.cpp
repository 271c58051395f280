#include "core/track_frame.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "core/kinematics.hpp"

namespace sila {
namespace {

/// Below this ratio of the two standard deviations' difference to the larger one no direction stands out.
constexpr double kSmallestContrast = 1e-6;

/// The direction of the largest variance.
Vector2 principal_axis(const std::vector<Vector2>& positions_m) {
  Vector2 mean = Vector2::Zero();
  for (const Vector2& p : positions_m) mean += p / static_cast<double>(positions_m.size());
  Matrix2 covariance = Matrix2::Zero();
  for (const Vector2& p : positions_m) covariance += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix2> solver(covariance);
  const Vector2 variances = solver.eigenvalues();  // ascending
  if (!(variances.y() - variances.x() > kSmallestContrast * variances.y())) return Vector2::UnitX();
  const Vector2 axis = solver.eigenvectors().col(1);
  const bool reversed = axis.x() != 0.0 ? axis.x() < 0.0 : axis.y() < 0.0;
  return reversed ? Vector2(-axis) : axis;
}

}  // namespace

Vector2 median_position(const std::vector<Vector2>& positions) {
  const auto median = [&](int axis) {
    std::vector<double> values;
    for (const Vector2& position : positions) values.push_back(position(axis));
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  return {median(0), median(1)};
}

double extent_m(const Trajectory& track) {
  Eigen::AlignedBox2d box;
  for (const Vector2& position : track.positions_m) box.extend(position);
  return box.diagonal().norm();
}

CurbFrame frame_of_tracks(std::span<const FramedTrajectory> tracks) {
  std::vector<Vector2> positions_m;
  for (const FramedTrajectory& entry : tracks)
    positions_m.insert(positions_m.end(), entry.track.positions_m.begin(), entry.track.positions_m.end());
  if (positions_m.empty()) throw std::invalid_argument("scene: no scene and no track gives the model its frame");
  const Vector2 axis = principal_axis(positions_m);
  const Matrix2 axes = axes_along(axis);
  for (Vector2& position_m : positions_m) position_m = axes.transpose() * position_m;
  // Rounded, because the median can be the exact position of a person who stands. Adding 0 turns -0 into 0.
  const Vector2 origin_m = (axes * median_position(positions_m)).array().round() + 0.0;
  CurbFrame frame = make_curb_frame(origin_m, axis, left_of(axis), kTrackFrameWidth_m);
  frame.from_tracks = true;
  return frame;
}

}  // namespace sila
