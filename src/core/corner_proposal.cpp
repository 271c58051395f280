#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "core/track_frame.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStep_m = 0.5;                      ///< length of the pieces whose headings are counted
constexpr double kNearHeading = kPi / 12;            ///< of a direction: 15 degrees
constexpr double kLeastAngle = 25.0 * kPi / 180.0;   ///< between the two directions; a frame needs 20.5 degrees
constexpr double kCell_m = 0.1, kSmoothing_m = 0.4;  ///< of the distribution of lateral positions
constexpr double kStripEdge = 0.25;                  ///< of its peak: the density at the edges of a strip
constexpr double kOtherStrip = 0.3;                  ///< of the highest peak: the lowest peak that is a strip
constexpr double kTurnRadius_m = 8.0, kOnArm_m = 3.0;
constexpr double kLeastShare = 0.05;  ///< of the distance walked along the second direction
constexpr std::size_t kParts = 10;

/// A straight piece of a track.
struct Piece {
  Vector2 middle_m;
  double length_m, heading_rad;
};

/// Where people walk in one direction. Positions are along the normal of the direction [m].
struct Strip {
  double low_m = 0.0, high_m = 0.0, density = 0.0;
  double middle_m() const { return 0.5 * (low_m + high_m); }
};

Vector2 unit(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

std::vector<Piece> pieces_of(std::span<const Trajectory* const> tracks) {
  std::vector<Piece> pieces;
  for (const Trajectory* track : tracks) {
    Vector2 last = track->positions_m.front();
    for (const Vector2& p : track->positions_m) {
      const Vector2 step_m = p - last;
      if (step_m.norm() < kStep_m) continue;
      pieces.push_back({0.5 * (p + last), step_m.norm(), std::atan2(step_m.y(), step_m.x())});
      last = p;
    }
  }
  return pieces;
}

/// Convolution with a Gaussian of `width` cells; `round`: the ends are joined.
std::vector<double> smoothed(const std::vector<double>& counts, double width, bool round) {
  const auto n = static_cast<std::ptrdiff_t>(counts.size()), reach = static_cast<std::ptrdiff_t>(std::ceil(3 * width));
  std::vector<double> result(counts.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
      const std::ptrdiff_t j = round ? ((i + k) % n + n) % n : i + k;
      if (j < 0 || j >= n) continue;
      result[static_cast<std::size_t>(i)] +=
          counts[static_cast<std::size_t>(j)] * std::exp(-0.5 * static_cast<double>(k * k) / (width * width));
    }
  }
  return result;
}

/// The angle between two directions without a sense, in [0, pi / 2].
double between(double a, double b) {
  const double d = std::fmod(std::abs(a - b), kPi);
  return std::min(d, kPi - d);
}

bool is_along(const Piece& piece, double heading) {
  return between(piece.heading_rad, heading) <= kNearHeading;
}

/// The mean heading, modulo pi, of the pieces along a heading.
double refined(const std::vector<Piece>& pieces, double heading) {
  Vector2 sum = Vector2::Zero();
  for (const Piece& piece : pieces) {
    if (is_along(piece, heading)) sum += piece.length_m * unit(2 * piece.heading_rad);
  }
  return 0.5 * std::atan2(sum.y(), sum.x());
}

/// The two main headings [rad]; none if there is no second one.
std::optional<std::array<double, 2>> main_headings(const std::vector<Piece>& pieces) {
  std::vector<double> counts(180);
  for (const Piece& piece : pieces) {
    const double angle = piece.heading_rad + 2 * kPi;
    counts[static_cast<std::size_t>(angle / kPi * 180.0) % 180] += piece.length_m;
  }
  counts = smoothed(counts, 5.0, true);
  const auto heading = [](std::size_t i) { return (static_cast<double>(i) + 0.5) * kPi / 180.0; };
  const auto first = static_cast<std::size_t>(std::ranges::max_element(counts) - counts.begin());
  std::optional<std::size_t> second;
  for (std::size_t i = 0; i < 180; ++i) {
    const bool peak = counts[i] > counts[(i + 179) % 180] && counts[i] >= counts[(i + 1) % 180];
    if (peak && between(heading(i), heading(first)) >= kLeastAngle && (!second || counts[i] > counts[*second]))
      second = i;
  }
  if (!second) return std::nullopt;
  return std::array{refined(pieces, heading(first)), refined(pieces, heading(*second))};
}

/// The strips in which people walk along a heading.
std::vector<Strip> strips_along(const std::vector<Piece>& pieces, double heading) {
  std::vector<std::pair<double, double>> lateral;  // position, distance walked
  for (const Piece& piece : pieces) {
    if (is_along(piece, heading)) lateral.emplace_back(left_of(unit(heading)).dot(piece.middle_m), piece.length_m);
  }
  const auto [low, high] = std::ranges::minmax(lateral, {}, &std::pair<double, double>::first);
  const double begin_m = low.first - 3 * kSmoothing_m;
  std::vector<double> counts(static_cast<std::size_t>((high.first - begin_m + 3 * kSmoothing_m) / kCell_m) + 1);
  for (const auto& [position, distance] : lateral)
    counts[static_cast<std::size_t>((position - begin_m) / kCell_m)] += distance;
  counts = smoothed(counts, kSmoothing_m / kCell_m, false);
  const double highest = *std::ranges::max_element(counts);
  std::vector<Strip> strips;
  for (std::size_t i = 1; i + 1 < counts.size(); ++i) {
    if (!(counts[i] > counts[i - 1] && counts[i] >= counts[i + 1] && counts[i] >= kOtherStrip * highest)) continue;
    std::size_t from = i, to = i;
    while (from > 0 && counts[from - 1] >= kStripEdge * counts[i]) --from;
    while (to + 1 < counts.size() && counts[to + 1] >= kStripEdge * counts[i]) ++to;
    const auto at = [&](std::size_t cell) { return begin_m + (static_cast<double>(cell) + 0.5) * kCell_m; };
    if (strips.empty() || at(from) >= strips.back().high_m) strips.push_back({at(from), at(to), counts[i]});
  }
  std::ranges::sort(strips, std::ranges::greater(), &Strip::density);
  return strips;
}

/// The crossing of two lines, each given by its position along the normal of its axis.
Vector2 crossing(const Vector2& axis_a, double a_m, const Vector2& axis_b, double b_m) {
  return (a_m * axis_b - b_m * axis_a) / cross(axis_a, axis_b);
}

/// A crossing of two strips, and the senses along the two axes between which most tracks turn there.
struct Crossing {
  Strip a, b;
  Vector2 place_m = Vector2::Zero();
  double sense_a = 1.0, sense_b = 1.0;
  std::size_t turning = 0;
};

/// The arm of a crossing that has this position: +-1 along axis a, +-2 along axis b, 0 if it is too near.
int arm_of(const Vector2& from_crossing_m, const Vector2& axis_a, const Vector2& axis_b) {
  if (from_crossing_m.norm() < kOnArm_m) return 0;
  const double a = axis_a.dot(from_crossing_m), b = axis_b.dot(from_crossing_m);
  return std::abs(a) > std::abs(b) ? (a > 0 ? 1 : -1) : (b > 0 ? 2 : -2);
}

void count_turns(Crossing& at, std::span<const Trajectory* const> tracks, const Vector2& axis_a,
                 const Vector2& axis_b) {
  std::array<std::size_t, 4> turns{};  // by the senses of the two arms
  for (const Trajectory* track : tracks) {
    int first = 0, last = 0;
    for (const Vector2& p : track->positions_m) {
      const Vector2 offset_m = p - at.place_m;
      const int arm = offset_m.norm() < kTurnRadius_m ? arm_of(offset_m, axis_a, axis_b) : 0;
      if (arm == 0) continue;
      if (first == 0) first = arm;
      last = arm;
    }
    if (std::abs(first) == 2) std::swap(first, last);
    if (std::abs(first) == 1 && std::abs(last) == 2) ++turns[(first > 0 ? 0U : 1U) + (last > 0 ? 0U : 2U)];
  }
  const auto most = static_cast<std::size_t>(std::ranges::max_element(turns) - turns.begin());
  at.turning = turns[most];
  at.sense_a = (most & 1U) != 0 ? -1.0 : 1.0;
  at.sense_b = (most & 2U) != 0 ? -1.0 : 1.0;
}

double share_along(const std::vector<Piece>& pieces, double heading) {
  double along = 0.0, all = 0.0;
  for (const Piece& piece : pieces) {
    all += piece.length_m;
    if (is_along(piece, heading)) along += piece.length_m;
  }
  return along / all;
}

/// The edge of the strip along `axis` that lies away from the block, into which the other axis points.
double curb_m(const Strip& strip, const Vector2& axis, const Vector2& other) {
  return left_of(axis).dot(other) > 0.0 ? strip.low_m : strip.high_m;
}

/// The proposal without standard errors; none if there is no second direction.
std::optional<CornerProposal> proposed(std::span<const Trajectory* const> tracks, bool y_down) {
  const std::vector<Piece> pieces = pieces_of(tracks);
  const auto headings = main_headings(pieces);
  if (!headings) return std::nullopt;
  const double share_a = share_along(pieces, (*headings)[0]), share_b = share_along(pieces, (*headings)[1]);
  if (share_b < kLeastShare) return std::nullopt;
  const Vector2 axis_a = unit((*headings)[0]), axis_b = unit((*headings)[1]);
  std::optional<Crossing> best;
  const std::vector<Strip> along_a = strips_along(pieces, (*headings)[0]),
                           along_b = strips_along(pieces, (*headings)[1]);
  for (const Strip& a : along_a) {
    for (const Strip& b : along_b) {
      Crossing at{a, b, crossing(axis_a, a.middle_m(), axis_b, b.middle_m())};
      count_turns(at, tracks, axis_a, axis_b);
      if (!best || at.turning > best->turning) best = at;
    }
  }
  const Vector2 away_a = best->sense_a * axis_a, away_b = best->sense_b * axis_b;
  const Vector2 origin_m = crossing(axis_a, curb_m(best->a, axis_a, away_b), axis_b, curb_m(best->b, axis_b, away_a));
  const double width_a = best->a.high_m - best->a.low_m, width_b = best->b.high_m - best->b.low_m;
  const bool swap = (cross(away_a, away_b) < 0.0) != y_down;
  CornerProposal result;
  result.widths = {0.5 * (width_a + width_b), swap ? width_b : width_a, swap ? width_a : width_b};
  result.frame = make_curb_frame(origin_m, swap ? away_b : away_a, swap ? away_a : away_b, result.widths.mean_m);
  result.share_1 = swap ? share_b : share_a;
  result.share_2 = swap ? share_a : share_b;
  result.turning_tracks = best->turning;
  return result;
}

/// The proposals of the jackknife: each without one of kParts parts of the tracks.
std::vector<CornerProposal> proposed_without_parts(const std::vector<const Trajectory*>& tracks, bool y_down) {
  std::vector<CornerProposal> proposals;
  for (std::size_t part = 0; part < kParts; ++part) {
    std::vector<const Trajectory*> others;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      if (i % kParts != part) others.push_back(tracks[i]);
    }
    if (const auto proposal = proposed(others, y_down)) proposals.push_back(*proposal);
  }
  return proposals;
}

}  // namespace

CornerProposal propose_corner(std::span<const Trajectory> tracks, bool y_down) {
  std::vector<const Trajectory*> moving;
  for (const Trajectory& track : tracks) {
    validate(track);
    if (extent_m(track) >= kOnArm_m) moving.push_back(&track);
  }
  if (moving.size() < kParts)
    throw invalid_argument("no corner found: expected at least ", kParts, " tracks that move 3 m or more, found ",
                           moving.size());
  auto result = proposed(moving, y_down);
  if (!result)
    throw invalid_argument(
        "no corner found: all people walk along one line; a corner needs a second direction, 25 degrees or more from "
        "the first");
  const std::vector<CornerProposal> parts = proposed_without_parts(moving, y_down);
  const auto error = [&](const auto& distance) {  // of a jackknife, about the full estimate
    double sum = 0.0;
    for (const CornerProposal& part : parts) sum += std::pow(distance(part), 2);
    return std::sqrt(sum * static_cast<double>(kParts - 1) / static_cast<double>(kParts));
  };
  // A part may have another corner of the crossing, whose axes point elsewhere along the same two lines.
  const auto angle = [](const Vector2& a, const Vector2& b) {
    return std::atan2(std::abs(cross(a, b)), std::abs(a.dot(b)));
  };
  result->origin_error_m =
      error([&](const auto& part) { return (part.frame.origin_m - result->frame.origin_m).norm(); });
  const CurbFrame& frame = result->frame;
  result->axis_error_rad = error([&](const auto& part) {
    const CurbFrame& other = part.frame;
    return std::min(std::max(angle(other.axis_1, frame.axis_1), angle(other.axis_2, frame.axis_2)),
                    std::max(angle(other.axis_1, frame.axis_2), angle(other.axis_2, frame.axis_1)));
  });
  return *result;
}

}  // namespace sila
