#include "clock.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "sila/core/errors.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

/// The commonest positive step from one frame of a person to the next; the smallest of equals, 1 if there is none.
double common_step(const std::vector<Detection>& rows) {
  std::unordered_map<std::string_view, std::vector<double>> frames;
  for (const Detection& row : rows) {
    if (std::isfinite(row.t_s)) frames[row.track].push_back(row.t_s);
  }
  std::map<double, std::size_t> counts;
  for (auto& [track, stamps] : frames) {
    std::sort(stamps.begin(), stamps.end());
    for (std::size_t i = 1; i < stamps.size(); ++i) {
      if (stamps[i] > stamps[i - 1]) ++counts[stamps[i] - stamps[i - 1]];
    }
  }
  double best = 1.0;
  std::size_t most = 0;
  for (const auto& [step, count] : counts) {
    if (count <= most) continue;
    best = step;
    most = count;
  }
  return best;
}

TrackFile at_rate(TrackFile file, double frames_per_second) {
  for (Detection& row : file.detections.rows) row.t_s /= frames_per_second;
  file.clock = "frames, " + exact(frames_per_second) + " per second";
  return file;
}

TrackFile at_interval(TrackFile file, double interval_s) {
  const double step = common_step(file.detections.rows);
  for (Detection& row : file.detections.rows) row.t_s = row.t_s / step * interval_s;
  file.clock = "frames, " + exact(interval_s) + " s for each step of " + exact(step);
  return file;
}

}  // namespace

TrackFile with_seconds(TrackFile frames, const ReadOptions& options, const FrameClock& of_format) {
  if (options.frames_per_second) return at_rate(std::move(frames), *options.frames_per_second);
  if (options.sample_interval_s) return at_interval(std::move(frames), *options.sample_interval_s);
  if (of_format.frames_per_second) return at_rate(std::move(frames), *of_format.frames_per_second);
  if (of_format.sample_interval_s) return at_interval(std::move(frames), *of_format.sample_interval_s);
  throw FormatError(frames.detections.source, 0, "time stamps, or a frame rate (frames_per_second)",
                    "frame numbers alone");
}

}  // namespace sila
