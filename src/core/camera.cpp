#include "sila/core/camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/concatenate.hpp"
#include "core/unit_warnings.hpp"
#include "sila/core/counted.hpp"

namespace sila {
namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

/// A homography is known if the second smallest singular value of the system is at least this share of the largest:
/// collinear points give 1e-16, well spread ones 0.1.
constexpr double kSmallestSingularShare = 1e-6;
/// As the smallest singular value of a normalised homography to its largest; the map would be onto a line.
constexpr double kSmallestConditionShare = 1e-9;

/// A picture with larger pixels shows no people [m].
constexpr double kLargestPixel_m = 0.5;

[[noreturn]] void reject_camera(const std::string& what) {
  throw invalid_argument("camera: ", what);
}

/// Moves the middle of points to 0 and scales their mean distance from it to the square root of 2.
Matrix3 normalisation(std::span<const PointPair> pairs, Vector2 PointPair::*member) {
  Vector2 middle = Vector2::Zero();
  for (const PointPair& pair : pairs) middle += pair.*member / static_cast<double>(pairs.size());
  double distance = 0.0;
  for (const PointPair& pair : pairs) distance += (pair.*member - middle).norm() / static_cast<double>(pairs.size());
  if (!std::isfinite(distance) || !(distance > 0.0)) reject_camera("the points repeat or are not finite");
  const double scale = std::sqrt(2.0) / distance;
  Matrix3 matrix;
  matrix << scale, 0.0, -scale * middle.x(), 0.0, scale, -scale * middle.y(), 0.0, 0.0, 1.0;
  return matrix;
}

/// The null vector of the direct linear transformation, in normalised coordinates.
Matrix3 solve(std::span<const PointPair> pairs, const Matrix3& of_image, const Matrix3& of_ground) {
  Eigen::Matrix<double, Eigen::Dynamic, 9> system = decltype(system)::Zero(2 * static_cast<int>(pairs.size()), 9);
  Eigen::Index row = 0;
  for (const PointPair& pair : pairs) {
    const Vector3 from = of_image * pair.image_px.homogeneous();
    const Vector3 to = of_ground * pair.ground_m.homogeneous();
    system.block<1, 3>(row, 0) = from.transpose();
    system.block<1, 3>(row, 6) = -to.x() * from.transpose();
    system.block<1, 3>(row + 1, 3) = from.transpose();
    system.block<1, 3>(row + 1, 6) = -to.y() * from.transpose();
    row += 2;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(system, Eigen::ComputeFullV);
  if (!(svd.singularValues()(7) > kSmallestSingularShare * svd.singularValues()(0)))
    reject_camera(
        "the points are collinear or repeat, so that many cameras fit; four points of which no three are on a line "
        "are needed");
  return svd.matrixV().col(8).reshaped<Eigen::RowMajor>(3, 3);
}

/// The homography to the ground as seen from a point of it. In coordinates of a map, which are large, that of the
/// camera itself could not be inverted with enough digits.
struct CentredHomography {
  Matrix3 ground_from_image;
  Vector2 centre_m;
};

CentredHomography centred(const Matrix3& homography) {
  const Vector3 w = homography.row(2).transpose();
  const Vector2 centre_m = homography.topRows<2>() * w / std::max(w.squaredNorm(), 1e-300);
  Matrix3 matrix = homography;
  matrix.topRows<2>() -= centre_m * w.transpose();
  return {matrix, centre_m};
}

/// The homogeneous image point of a point on the ground, and the map that makes it of ground coordinates.
struct BackProjection {
  Matrix3 image_from_ground;
  Vector3 image;
};

BackProjection back_project(const Camera& camera, const Vector2& ground_m) {
  const auto [matrix, centre_m] = centred(camera.ground_from_image);
  const Matrix3 inverse = matrix.inverse();
  return {inverse, inverse * (ground_m - centre_m).homogeneous()};
}

}  // namespace

CameraFit fit_camera(std::span<const PointPair> pairs) {
  if (pairs.size() < 4) reject_camera(counted(pairs.size(), "pair") + " of points, at least 4 are needed");
  const Matrix3 of_image = normalisation(pairs, &PointPair::image_px);
  const Matrix3 of_ground = normalisation(pairs, &PointPair::ground_m);
  const Matrix3 normalised = solve(pairs, of_image, of_ground);
  (void)camera_of(normalised);  // rejects a map onto a line
  const Matrix3 homography = of_ground.inverse() * normalised * of_image;
  CameraFit fit{camera_of(homography, pairs.front().image_px), {}};
  for (const PointPair& pair : pairs) {
    const std::optional<Vector2> ground_m = to_ground(fit.camera, pair.image_px);
    if (!ground_m) reject_camera("its horizon passes between the points; the pairs contradict each other");
    fit.residuals_m.push_back((*ground_m - pair.ground_m).norm());
  }
  return fit;
}

Camera camera_of(const Matrix3& ground_from_image, const std::optional<Vector2>& seen_px) {
  if (!ground_from_image.allFinite()) reject_camera("the homography is not finite");
  const Matrix3 scaled = ground_from_image / std::max(ground_from_image.cwiseAbs().maxCoeff(), 1e-300);
  const Matrix3 near = centred(scaled).ground_from_image;
  const Vector3 singular = Eigen::JacobiSVD<Matrix3>(near).singularValues();
  if (!(singular(2) > kSmallestConditionShare * singular(0))) reject_camera("the homography is not invertible");
  const double below = scaled(2, 1) != 0.0 ? scaled(2, 1) : scaled(2, 2);  // w far below the horizon has its sign
  const double w = seen_px ? scaled.row(2).dot(seen_px->homogeneous()) : below;
  return {w < 0.0 ? Matrix3(-scaled) : scaled};
}

std::optional<Vector2> to_ground(const Camera& camera, const Vector2& image_px) {
  const Vector3 p = camera.ground_from_image * image_px.homogeneous();
  if (!(p.z() > 0.0)) return std::nullopt;
  return p.hnormalized();
}

std::optional<Vector2> to_image(const Camera& camera, const Vector2& ground_m) {
  // With (x, y, 1) = H (u, v, 1) / w the inverse gives (u, v, 1) / w, so that its last entry has the sign of w.
  const Vector3 p = back_project(camera, ground_m).image;
  if (!(p.z() > 0.0)) return std::nullopt;
  return p.hnormalized();
}

Matrix2 image_jacobian(const Camera& camera, const Vector2& ground_m) {
  const auto [inverse, p] = back_project(camera, ground_m);
  if (!(p.z() > 0.0)) reject_camera("the point is behind it");
  const Vector2 image_px = p.hnormalized();
  return (inverse.topLeftCorner<2, 2>() - image_px * inverse.row(2).head<2>()) / p.z();
}

Camera flat_camera(double metres_per_pixel) {
  return camera_of(Vector3(metres_per_pixel, -metres_per_pixel, 1.0).asDiagonal().toDenseMatrix());
}

WalkingScale walking_scale(std::span<const Trajectory> tracks) {
  std::vector<double> speeds = walking_speeds(tracks);
  const std::size_t walking = speeds.size();
  if (walking < kFewestWalking)
    throw invalid_argument("units = pixels: ", walking, " of the first ", tracks.size(),
                           " tracks walk for 3 s or more, ", kFewestWalking,
                           " are needed to measure the scale; give a camera or metres_per_unit");
  const double metres_per_pixel = kWalkingSpeed_mps * kTrialMetresPerPixel / quantile(std::move(speeds), 0.5);
  if (!(metres_per_pixel < kLargestPixel_m))
    throw invalid_argument("units = pixels: by the walking speed a pixel is ", metres_per_pixel,
                           " m, which is too large; are the positions metres?");
  return {metres_per_pixel, walking};
}

}  // namespace sila
