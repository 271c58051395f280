#include "sila/core/plausibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace sila {
namespace {

constexpr double kRunner_mps = 10.0;    ///< no quarter of the pedestrians of a place moves faster
constexpr double kLargePlace_m = 50.0;  ///< whole-number coordinates over a larger place are not metres
constexpr std::size_t kFewRows = 10;    ///< too few to say anything

/// The value below which the share `q` of them lies; 0 for none.
double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

struct Impression {
  Eigen::AlignedBox2d box;
  std::size_t rows = 0;
  bool whole_numbers = true;
  double brisk_mps = 0.0;   ///< upper quartile over tracks of the median speed
  double interval_s = 0.0;  ///< median time between samples of a track
};

Impression impression_of(std::span<const Trajectory> tracks) {
  Impression result;
  std::vector<double> speeds;
  std::vector<double> intervals;
  for (const Trajectory& track : tracks) {
    std::vector<double> steps;
    result.rows += track.times_s.size();
    for (std::size_t i = 0; i < track.times_s.size(); ++i) {
      const Vector2& position = track.positions_m[i];
      result.box.extend(position);
      result.whole_numbers = result.whole_numbers && position == position.array().round().matrix();
      if (i == 0 || track.times_s[i] <= track.times_s[i - 1]) continue;
      intervals.push_back(track.times_s[i] - track.times_s[i - 1]);
      steps.push_back((position - track.positions_m[i - 1]).norm() / intervals.back());
    }
    if (!steps.empty()) speeds.push_back(quantile(std::move(steps), 0.5));
  }
  result.brisk_mps = quantile(std::move(speeds), 0.75);
  result.interval_s = quantile(std::move(intervals), 0.5);
  return result;
}

std::string size_text(const Eigen::AlignedBox2d& box) {
  std::ostringstream text;
  text << box.sizes().x() << " x " << box.sizes().y();
  return text.str();
}

}  // namespace

std::vector<std::string> unit_doubts(std::span<const Trajectory> tracks, double max_gap_s) {
  const Impression seen = impression_of(tracks);
  std::vector<std::string> doubts;
  if (seen.rows < kFewRows) return doubts;
  std::ostringstream text;
  if (seen.interval_s > max_gap_s) {
    text << "the samples of a track are " << seen.interval_s << " s apart; are the stamps frames or milliseconds?";
    doubts.push_back(text.str());
    text.str({});
  }
  const bool large = seen.box.sizes().maxCoeff() > kLargePlace_m;
  if (seen.brisk_mps > kRunner_mps) {
    text << "these look like pixels (or centimetres, or stamps that are not seconds): a quarter of the tracks is "
            "faster than "
         << seen.brisk_mps << " m/s, in a place of " << size_text(seen.box) << " m; give metres_per_unit";
    doubts.push_back(text.str());
  } else if (seen.whole_numbers && large) {
    text << "these look like pixels: all coordinates are whole numbers, in a place of " << size_text(seen.box)
         << " m; give metres_per_unit";
    doubts.push_back(text.str());
  }
  return doubts;
}

}  // namespace sila
