#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace sila {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;

/// The unit of the curb coordinates.
enum class CurbScaling {
  metres,      ///< q = xi: a metre along each axis, so that sites of different width have the same cells
  mean_width,  ///< q = xi / w with one width for the corner (paper)
};
inline constexpr std::array<const char*, 2> kCurbScalings = {"metres", "mean_width"};

/// The common curbside frame: contravariant coordinates along the two curbs of a corner, in curb units (metres, or
/// sidewalk widths: see CurbScaling).
/// Invariant: axes of length 1, |sin(angle between them)| >= 0.35, unit_m > 0; `to_world(f, to_curb(f, p)) == p`.
/// Source: Jaipuria, Habibi, How 2018 (contravariant distances); SILA paper, section on the common frame.
struct CurbFrame {
  Vector2 origin_m = Vector2::Zero();  ///< the virtual intersection of the two straight curbs, world frame
  Vector2 axis_1 = Vector2::UnitX();   ///< unit vector along curb 1, away from the corner, but see `rescaled`
  Vector2 axis_2 = Vector2::UnitY();   ///< unit vector along curb 2, likewise
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

/// Makes a frame in metres; the axes are normalised.
/// Throws: std::invalid_argument for a zero or non-finite axis, near-parallel curbs (|sin| < 0.35), a width that is not
/// positive.
CurbFrame make_curb_frame(const Vector2& origin_m, const Vector2& axis_1, const Vector2& axis_2,
                          double sidewalk_width_m);

/// The same corner with another unit of the curb coordinates. In widths the axes stay as they are. In metres they are
/// turned to a right angle about the same bisector, so that cells and kernels are as wide in one direction as in
/// another. The result then has the directions of the curbs only if these have a right angle (|cosine| below 1e-9);
/// from it they cannot be found again, also not by `rescaled` to widths. Source: docs/decisions/0137-right-angle.md.
CurbFrame rescaled(CurbFrame frame, CurbScaling scaling);

/// Throws std::invalid_argument if the invariant does not hold.
void validate(const CurbFrame& frame);

/// The matrix that takes curb coordinates to world displacements [m per unit]; its columns are the scaled axes.
Matrix2 world_from_curb(const CurbFrame& frame);

/// Positions and velocities in the other frame: [m] and [curb units], [m/s] and [curb units/s]. Source: docs/method.md,
/// M1.
Vector2 to_curb(const CurbFrame& frame, const Vector2& world_m);
Vector2 to_world(const CurbFrame& frame, const Vector2& curb);
Vector2 velocity_to_curb(const CurbFrame& frame, const Vector2& world_mps);
Vector2 velocity_to_world(const CurbFrame& frame, const Vector2& curb_per_s);

/// A time-stamped path in the world frame, at most 1e6 s long.
/// Invariant: as many positions as times, at least one of each, times strictly increasing, none over 1e12.
struct Trajectory {
  std::string id;
  std::vector<double> times_s;
  std::vector<Vector2> positions_m;
  std::size_t recording = 0;  ///< which input it comes from; only tracks of one recording have a common clock
};

/// A path in the frame of a corner, with velocities, sampled at equal intervals. A type of its own, so that the two
/// frames cannot be mixed up. Invariant: as `Trajectory`; as many velocities as positions.
struct CurbTrajectory {
  std::string id;
  CurbFrame frame;                  ///< of the corner; converts predictions to metres
  std::vector<double> times_s;      ///< on the clock of the input
  std::vector<Vector2> positions;   ///< curb units
  std::vector<Vector2> velocities;  ///< curb units per second
  double still_s = 0.0;  ///< time for which the whole track stayed within 0.5 m of its last position [s]; at most 60
  /// Velocity of companions relative to the person's own at the end [m/s], world frame (core/companions.hpp); zero
  /// without companions, or if the other people are not known.
  Vector2 companions_mps = Vector2::Zero();
};

/// Throws std::invalid_argument, naming the track and the sample, if the invariant does not hold.
void validate(const Trajectory& track);
void validate(const CurbTrajectory& track);

/// A track in the world frame, and the frame of the corner that it belongs to.
struct FramedTrajectory {
  Trajectory track;
  CurbFrame frame;
};

/// An observed path and its future.
struct Window {
  CurbTrajectory observed;
  std::vector<Vector2> past_m;    ///< the raw positions at the times of `observed`
  std::vector<Vector2> future_m;  ///< at the predictor's interval; may end before the horizon
};

/// A corner proposed from where people walk, with the standard errors of ten parts of the tracks (jackknife).
struct CornerProposal {
  CurbFrame frame;
  SidewalkWidths widths;
  double origin_error_m = 0.0;  ///< of the origin; large if the parts disagree about the corner
  double axis_error_rad = 0.0;  ///< of the direction of either axis, the larger one
  double share_1 = 0.0;         ///< share of the distance walked within 15 degrees of axis_1; share_2: of axis_2
  double share_2 = 0.0;
  std::size_t turning_tracks = 0;  ///< that turn from one axis into the other at this corner
};

/// The corner at which most tracks turn between the two main directions of walking: the directions are the two highest
/// peaks of the distribution of headings modulo 180 degrees, at least 25 degrees apart; along each, the strips in
/// which people walk are the peaks of the distribution of lateral positions. The corner of the strips away from the
/// block, which is where the turning tracks pass, is the origin. Widths are those of the strips that people use, which
/// is less than from curb to wall. axis_2 is axis_1 turned counter-clockwise, seen from above; `y_down`: y points down,
/// as in pictures.
/// Shapes: at least 10 tracks that move 3 m. Units: metres, world frame.
/// Throws: std::invalid_argument for fewer tracks, and without a second direction in which a twentieth of the distance
/// is walked. Source: none; docs/decisions/0114-corner-from-tracks.md.
CornerProposal propose_corner(std::span<const Trajectory> tracks, bool y_down = false);

}  // namespace sila
