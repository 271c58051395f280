#include "core/unit_warnings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/concatenate.hpp"
#include "core/track_cuts.hpp"

namespace sila {
namespace {

constexpr double kRunner_mps = 10.0;    ///< no quarter of the pedestrians of a place moves faster
constexpr double kLargePlace_m = 50.0;  ///< coordinates in whole and half numbers over a larger place are not metres
constexpr double kDegreesPlace = 0.01;  ///< a place of 1 km in degrees; in metres the noise of any tracker is larger
constexpr std::size_t kFewRows = 10;    ///< too few to say anything
constexpr double kSlowWalk_mps = 0.25;  ///< people who walk are faster, also in a dense crowd
constexpr double kFastWalk_mps = 3.0;   ///< at no place half of the people run

/// Displacement over about one second, per second, at every sample of a track where it exists. Shorter times would not
/// do: interpolated pixel positions stand still for some frames and then leap.
std::vector<double> speeds_of(const Trajectory& track) {
  constexpr double window_s = 1.0;
  std::vector<double> speeds;
  std::size_t from = 0;
  for (std::size_t i = 1; i < track.times_s.size(); ++i) {
    while (from + 1 < i && track.times_s[i] - track.times_s[from + 1] >= window_s) ++from;
    const double passed_s = track.times_s[i] - track.times_s[from];
    const bool is_whole = passed_s >= window_s || i + 1 == track.times_s.size();
    if (passed_s > 0.0 && is_whole)
      speeds.push_back((track.positions_m[i] - track.positions_m[from]).norm() / passed_s);
  }
  return speeds;
}

struct TrackSummary {
  Eigen::AlignedBox2d box;
  std::size_t rows = 0;
  bool half_numbers = true;         ///< every coordinate is a multiple of one half, as the centre of a pixel box is
  double upper_quartile_mps = 0.0;  ///< upper quartile over tracks of the median speed
  double interval_s = 0.0;          ///< median time between samples of a track
};

TrackSummary summary_of(std::span<const Trajectory> tracks) {
  TrackSummary result;
  std::vector<double> speeds;
  std::vector<double> intervals;
  for (const Trajectory& track : tracks) {
    result.rows += track.times_s.size();
    for (std::size_t i = 0; i < track.times_s.size(); ++i) {
      const Vector2 doubled = 2.0 * track.positions_m[i];
      result.box.extend(track.positions_m[i]);
      result.half_numbers = result.half_numbers && doubled == doubled.array().round().matrix();
      if (i > 0 && track.times_s[i] > track.times_s[i - 1])
        intervals.push_back(track.times_s[i] - track.times_s[i - 1]);
    }
    const std::vector<double> of_track = speeds_of(track);
    if (!of_track.empty()) speeds.push_back(quantile(of_track, 0.5));
  }
  result.upper_quartile_mps = quantile(std::move(speeds), 0.75);
  result.interval_s = quantile(std::move(intervals), 0.5);
  return result;
}

std::string size_text(const Eigen::AlignedBox2d& box) {
  return concatenate(box.sizes().x(), " x ", box.sizes().y());
}

/// Null for a track that stands, goes to and fro, or is too short.
std::optional<double> walking_speed(const Trajectory& track) {
  constexpr double step_s = 1.0 - 1e-6;
  constexpr std::size_t fewest_steps = 3;
  std::vector<double> speeds;
  double length = 0.0;
  std::size_t from = 0;
  for (std::size_t i = 1; i < track.times_s.size(); ++i) {
    const double passed_s = track.times_s[i] - track.times_s[from];
    if (passed_s < step_s) continue;
    const double step = (track.positions_m[i] - track.positions_m[from]).norm();
    speeds.push_back(step / passed_s);
    length += step;
    from = i;
  }
  if (speeds.size() < fewest_steps || !(length > 0.0)) return std::nullopt;
  if ((track.positions_m[from] - track.positions_m.front()).norm() < 0.5 * length) return std::nullopt;
  const double fast = quantile(speeds, 0.9);
  std::erase_if(speeds, [&](double speed) { return speed < 0.5 * fast; });  // pauses
  return quantile(std::move(speeds), 0.5);
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

std::vector<double> walking_speeds(std::span<const Trajectory> tracks) {
  std::vector<double> speeds;
  for (const Trajectory& track : tracks) {
    if (const std::optional<double> speed = walking_speed(track)) speeds.push_back(*speed);
  }
  return speeds;
}

std::string gap_setting(std::span<const Trajectory> tracks, double max_gap_s) {
  std::vector<double> gaps_s;
  for (const Trajectory& track : tracks) {
    for (std::size_t i = 1; i < track.times_s.size(); ++i) {
      const double gap_s = track.times_s[i] - track.times_s[i - 1];
      if (gap_s > max_gap_s) gaps_s.push_back(gap_s);
    }
  }
  const double value_s = std::ceil(2.0 * quantile(std::move(gaps_s), 0.5));
  const bool in_range = value_s > max_gap_s && value_s <= CleanConfig::largest_max_gap_s;
  return in_range ? concatenate("clean.max_gap_s=", value_s) : "clean.max_gap_s";
}

std::vector<std::string> unit_warnings(std::span<const Trajectory> tracks, double max_gap_s, bool live) {
  const std::string remedy = live ? "give a camera (--camera, in Python camera=), or send metres and seconds"
                                  : "give a camera (--camera), metres_per_unit (--metres-per-unit) or, for a new "
                                    "model, --units pixels (units=\"pixels\")";
  const TrackSummary seen = summary_of(tracks);
  std::vector<std::string> warnings;
  if (seen.rows < kFewRows) return warnings;
  if (seen.interval_s > (1.0 + kStampJitter) * max_gap_s)
    warnings.push_back(concatenate("the samples of a track are ", seen.interval_s,
                                   " s apart; are the stamps frames or milliseconds? ",
                                   live ? "Send seconds" : "In a CSV file, name their column frame or t_ms",
                                   ". If they are seconds, set ", gap_setting(tracks, max_gap_s)));
  const bool large = seen.box.sizes().maxCoeff() > kLargePlace_m;
  if (seen.upper_quartile_mps > kRunner_mps) {
    warnings.push_back(concatenate(
        "these look like pixels (or centimetres, or stamps that are not seconds): a quarter of the tracks is faster "
        "than ",
        seen.upper_quartile_mps, " m/s, in a place of ", size_text(seen.box), " m; ", remedy));
  } else if (seen.half_numbers && large) {
    warnings.push_back("these look like pixels: all coordinates are multiples of one half, in a place of " +
                       size_text(seen.box) + " m; " + remedy);
  }
  if (const double size = seen.box.sizes().maxCoeff(); size > 0.0 && size < kDegreesPlace) {
    warnings.push_back(concatenate("all positions lie within ", size_text(seen.box),
                                   " m: are they degrees of latitude and longitude? Convert them to metres (UTM)"));
    return warnings;
  }
  const std::vector<double> walking = walking_speeds(tracks);
  const double walk_mps = quantile(walking, 0.5);
  if (walking.size() < kFewestWalking) return warnings;
  if (walk_mps < kSlowWalk_mps)
    warnings.push_back(concatenate(
        "people walk at ", walk_mps,
        " m/s here: are the positions metres that are read as pixels, or is the scale or the clock wrong? Give no "
        "camera and no scale for metres; a model learnt in pixels needs pixels"));
  if (walk_mps > kFastWalk_mps && seen.upper_quartile_mps <= kRunner_mps)
    warnings.push_back(concatenate("people walk at ", walk_mps,
                                   " m/s here: are the positions feet or pixels, or is the frame rate or the clock "
                                   "wrong? If they are not metres, ",
                                   remedy));
  return warnings;
}

}  // namespace sila
