#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// A camera that does not move and looks at flat ground: the homography from image points [pixels] to the ground [m].
/// Invariant: finite, invertible, and w > 0 for image points below the horizon, where (x w, y w, w) = H (u, v, 1).
struct Camera {
  Eigen::Matrix3d ground_from_image = Eigen::Matrix3d::Identity();
  bool operator==(const Camera&) const = default;
};

/// A point in the image and the same point on the ground.
struct PointPair {
  Vector2 image_px = Vector2::Zero();
  Vector2 ground_m = Vector2::Zero();
};

/// A fitted camera, and for each pair the distance [m] between its ground point and the image of its image point.
struct CameraFit {
  Camera camera;
  std::vector<double> residuals_m;
};

/// Fits a camera by the normalised direct linear transformation.
/// Shapes: four pairs or more, of which three or fewer lie on one line.
/// Throws: std::invalid_argument for fewer pairs, pairs that repeat or are collinear so that no camera or many cameras
/// fit, and for a fit whose horizon passes between the points.
/// Source: Hartley and Zisserman, Multiple View Geometry, algorithm 4.2.
CameraFit fit_camera(std::span<const PointPair> pairs);

/// The camera of a homography; `seen_px` is an image point on the ground, which gives the sign of the matrix. Without
/// it the ground is taken to be below the horizon (v points down), as for every camera that is held upright. Throws:
/// std::invalid_argument for a matrix that is not finite or not invertible.
Camera camera_of(const Eigen::Matrix3d& ground_from_image, const std::optional<Vector2>& seen_px = {});

/// The point on the ground that an image point shows; null at and above the horizon.
std::optional<Vector2> to_ground(const Camera& camera, const Vector2& image_px);

/// The image point [pixels] of a point on the ground; null behind the camera.
std::optional<Vector2> to_image(const Camera& camera, const Vector2& ground_m);

/// The derivative of `to_image` [pixels per metre], with which covariances come into the image: J C J^T.
/// Throws: std::invalid_argument for a point behind the camera.
Matrix2 image_jacobian(const Camera& camera, const Vector2& ground_m);

/// The camera of a picture that has one scale everywhere, as if taken from straight above: x to the right, y upwards.
/// Throws: std::invalid_argument for a scale of zero or one that is not finite.
Camera flat_camera(double metres_per_pixel);

/// Usual walking speed [m/s], by which a picture without a camera gets its scale.
/// Source: docs/decisions/0118-pixels-without-a-camera.md.
inline constexpr double kWalkingSpeed_mps = 1.3;
/// The scale at which tracks are read to measure their speed: so small that no limit in metres cuts a track.
inline constexpr double kTrialMetresPerPixel = 1e-3;
/// Number of tracks, the first of the input, by which the scale is measured.
inline constexpr std::size_t kScaleTracks = 100;

/// A measured scale, and the number of tracks it was measured on.
struct WalkingScale {
  double metres_per_pixel = 0.0;
  std::size_t walking = 0;  ///< tracks that walk
};

/// The scale at which the median speed of the tracks that walk is kWalkingSpeed_mps. `tracks` are read at
/// kTrialMetresPerPixel. Throws: std::invalid_argument if fewer than five walk, and for pixels of over 0.5 m. Source:
/// docs/decisions/0118-pixels-without-a-camera.md.
WalkingScale walking_scale(std::span<const Trajectory> tracks);

}  // namespace sila
