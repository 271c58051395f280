#include <cmath>
#include <numbers>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {
namespace {

/// Below this |sin| (angles under 20.5 or over 159.5 degrees) the inverse map amplifies noise more than threefold.
constexpr double kSmallestSine = 0.35;
/// Axes with a smaller |cosine| stay as they are, bit for bit.
constexpr double kRightAngle = 1e-9;

[[noreturn]] void reject_frame(const auto&... parts) {
  throw invalid_argument("curb_frame: ", parts...);
}

Vector2 unit_axis(const char* name, const Vector2& axis) {
  const double length = axis.norm();
  if (!std::isfinite(length) || length < 1e-9) reject_frame(name, " has no direction; it must be a non-zero vector");
  return axis / length;
}

void require_positive(const char* name, double value) {
  if (!(value > 0.0 && std::isfinite(value))) reject_frame(name, " = ", value, ", it must be positive");
}

}  // namespace

CurbFrame make_curb_frame(const Vector2& origin_m, const Vector2& axis_1, const Vector2& axis_2,
                          double sidewalk_width_m) {
  const CurbFrame frame{.origin_m = origin_m,
                        .axis_1 = unit_axis("axis_1", axis_1),
                        .axis_2 = unit_axis("axis_2", axis_2),
                        .sidewalk_width_m = sidewalk_width_m};
  validate(frame);
  return frame;
}

CurbFrame rescaled(CurbFrame frame, CurbScaling scaling) {
  const bool metres = scaling == CurbScaling::metres;
  frame.unit_m = Vector2::Constant(metres ? 1.0 : frame.sidewalk_width_m);
  if (!metres || std::abs(frame.axis_1.dot(frame.axis_2)) < kRightAngle) return frame;
  const Vector2 between = (frame.axis_1 + frame.axis_2).normalized();
  const Vector2 across = (frame.axis_2 - frame.axis_1).normalized();
  frame.axis_1 = (between - across).normalized();
  frame.axis_2 = (between + across).normalized();
  return frame;
}

void validate(const CurbFrame& frame) {
  if (!frame.origin_m.allFinite()) reject_frame("origin is not finite");
  for (const Vector2& axis : {frame.axis_1, frame.axis_2}) {
    if (!(std::abs(axis.norm() - 1.0) <= 1e-6)) reject_frame("axis_1 and axis_2 must have the length 1");
  }
  require_positive("sidewalk_width_m", frame.sidewalk_width_m);
  require_positive("unit_m of axis_1", frame.unit_m.x());
  require_positive("unit_m of axis_2", frame.unit_m.y());
  const double sine = std::abs(cross(frame.axis_1, frame.axis_2));
  if (sine >= kSmallestSine) return;
  const double angle_rad = std::atan2(sine, frame.axis_1.dot(frame.axis_2));
  reject_frame("the angle between axis_1 and axis_2 is ", angle_rad * 180.0 / std::numbers::pi,
               " degrees, it must be 20.5 to 159.5");
}

Matrix2 world_from_curb(const CurbFrame& frame) {
  Matrix2 matrix;
  matrix << frame.axis_1 * frame.unit_m.x(), frame.axis_2 * frame.unit_m.y();
  return matrix;
}

Vector2 to_curb(const CurbFrame& frame, const Vector2& world_m) {
  return velocity_to_curb(frame, world_m - frame.origin_m);
}

Vector2 to_world(const CurbFrame& frame, const Vector2& curb) {
  return frame.origin_m + velocity_to_world(frame, curb);
}

Vector2 velocity_to_curb(const CurbFrame& frame, const Vector2& world_mps) {
  const double sine = cross(frame.axis_1, frame.axis_2);
  return Vector2(cross(world_mps, frame.axis_2), cross(frame.axis_1, world_mps)).cwiseQuotient(sine * frame.unit_m);
}

Vector2 velocity_to_world(const CurbFrame& frame, const Vector2& curb_per_s) {
  return world_from_curb(frame) * curb_per_s;
}

}  // namespace sila
