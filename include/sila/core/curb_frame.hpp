#pragma once

#include <Eigen/Core>
#include <array>

namespace sila {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;

/// The unit of the curb coordinates.
enum class CurbScaling {
  metres,        ///< q = xi: a metre along each axis, so that sites of different width have the same cells
  mean_width,    ///< q = xi / w with one width for the corner (paper)
  strip_widths,  ///< per axis, so that each sidewalk is the strip [0, 1] at every angle between the curbs
};
inline constexpr std::array<const char*, 3> kCurbScalings = {"metres", "mean_width", "strip_widths"};

/// The common curbside frame: contravariant coordinates along the two curbs of a corner, in curb units (metres, or
/// sidewalk widths: see CurbScaling; a "width" in older comments is a curb unit).
/// Invariant: axes of length 1, |sin(angle between them)| >= 0.35, unit_m > 0; `to_world(f, to_curb(f, p)) == p`.
/// Source: Jaipuria, Habibi, How 2018 (contravariant distances); SILA paper, section on the common frame.
struct CurbFrame {
  Vector2 origin_m = Vector2::Zero();  ///< the virtual intersection of the two straight curbs, world frame
  Vector2 axis_1 = Vector2::UnitX();   ///< unit vector along curb 1, away from the corner
  Vector2 axis_2 = Vector2::UnitY();   ///< unit vector along curb 2, away from the corner
  Vector2 unit_m = Vector2::Ones();    ///< metres along axis_1 and axis_2 of one unit of the curb coordinates
  double sidewalk_width_m = 1.0;       ///< mean width of the two sidewalks
  bool from_tracks = false;            ///< made by frame_of_tracks: no scene file describes it
};

/// The widths of the two sidewalks of a corner: `width_1_m` of the strip along axis_1, `width_2_m` of that along
/// axis_2.
struct SidewalkWidths {
  double mean_m = 1.0;
  double width_1_m = 1.0;
  double width_2_m = 1.0;
};

/// Makes a frame; the axes are normalised.
/// Throws: std::invalid_argument for a zero or non-finite axis, near-parallel curbs (|sin| < 0.35), a width that is not
/// positive.
CurbFrame make_curb_frame(const Vector2& origin_m, const Vector2& axis_1, const Vector2& axis_2,
                          const SidewalkWidths& widths, CurbScaling scaling);

/// The same corner with another unit of the curb coordinates. By strip widths it stays as it is: they are not known any
/// more.
CurbFrame rescaled(CurbFrame frame, CurbScaling scaling);

/// Throws std::invalid_argument if the invariant does not hold.
void validate(const CurbFrame& frame);

/// The matrix that takes curb coordinates to world displacements [m per unit]; its columns are the scaled axes.
Matrix2 world_from_curb(const CurbFrame& frame);

Vector2 to_curb(const CurbFrame& frame, const Vector2& world_m);
Vector2 to_world(const CurbFrame& frame, const Vector2& curb);
Vector2 velocity_to_curb(const CurbFrame& frame, const Vector2& world_mps);
Vector2 velocity_to_world(const CurbFrame& frame, const Vector2& curb_per_s);

}  // namespace sila
