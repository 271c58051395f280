#include "sila/core/sampling.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sampling_simd.hpp"

namespace sila {
namespace {

/// Kernel weights beyond this many widths are below 4e-4 and left out.
constexpr double kKernelReach = 4.0;
/// Stamps are compared with this slack, far below any tracker's resolution.
constexpr double kTimeSlack_s = 1e-6;

double median_interval(std::span<const double> times_s) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times_s.size(); ++i) intervals.push_back(times_s[i] - times_s[i - 1]);
  if (intervals.empty()) return 0.0;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

double kernel_width_s(std::span<const double> times_s, const SamplingConfig& config) {
  return std::max(config.smoothing_s, config.smoothing_intervals * median_interval(times_s));
}

MotionState local_line(const Trajectory& track, double time_s, std::size_t known, double width_s) {
  const auto begin = track.times_s.begin(), end = begin + static_cast<std::ptrdiff_t>(known);
  const auto from = std::lower_bound(begin, end, time_s - kKernelReach * width_s);
  const auto to = std::upper_bound(from, end, time_s + kKernelReach * width_s);
  const auto count = static_cast<std::size_t>(to - from);
  const detail::KernelSums sums = detail::kernel_sums(
      std::span(from, count), std::span(track.positions_m).subspan(static_cast<std::size_t>(from - begin), count),
      time_s, width_s);
  if (sums.weight < 1e-12) {  // nothing in reach: the nearest known sample, at rest
    const auto next = std::min(std::lower_bound(begin, end, time_s), end - 1);
    return {track.positions_m[static_cast<std::size_t>(next - begin)], Vector2::Zero()};
  }
  const double mean_time = sums.time / sums.weight;
  const double spread = sums.time_square / sums.weight - mean_time * mean_time;
  const Vector2 mean = sums.position / sums.weight;
  const Vector2 slope =
      spread < 1e-12 ? Vector2(Vector2::Zero()) : Vector2((sums.product / sums.weight - mean_time * mean) / spread);
  return {mean - slope * mean_time, slope};
}

/// On the straight line between the samples around `time_s`; the first or last sample outside them.
Vector2 raw_position_m(const Trajectory& track, double time_s) {
  const auto after = std::lower_bound(track.times_s.begin(), track.times_s.end(), time_s);
  if (after == track.times_s.begin()) return track.positions_m.front();
  if (after == track.times_s.end()) return track.positions_m.back();
  const auto next = static_cast<std::size_t>(after - track.times_s.begin());
  const double before_s = track.times_s[next - 1];
  const double share = (time_s - before_s) / (track.times_s[next] - before_s);
  return (1.0 - share) * track.positions_m[next - 1] + share * track.positions_m[next];
}

/// The times of `observe`, the last one exactly that of sample `last`.
std::vector<double> observed_times_s(const Trajectory& track, std::size_t last, double observe_s, double interval_s) {
  const double t0_s = track.times_s.at(last);
  std::vector<double> times_s;
  for (long k = std::max(std::lround(observe_s / interval_s), 1L) - 1; k >= 0; --k) {
    const double time_s = t0_s - static_cast<double>(k) * interval_s;
    if (time_s >= track.times_s.front() - kTimeSlack_s) times_s.push_back(time_s);
  }
  return times_s;
}

CurbTrajectory in_frame(const Trajectory& track, const CurbFrame& frame, std::vector<double> times_s,
                        const std::vector<MotionState>& states) {
  CurbTrajectory result{track.id, frame, std::move(times_s), {}, {}};
  result.positions.reserve(states.size());
  result.velocities.reserve(states.size());
  for (const MotionState& state : states) {
    result.positions.push_back(to_curb(frame, state.position_m));
    result.velocities.push_back(velocity_to_curb(frame, state.velocity_mps));
  }
  return result;
}

}  // namespace

std::vector<MotionState> smooth(const Trajectory& track, std::span<const double> times_s, std::size_t known,
                                const SamplingConfig& config) {
  if (known == 0 || known > track.times_s.size()) {
    throw std::invalid_argument("smooth: known = " + std::to_string(known) + ", the track has " +
                                std::to_string(track.times_s.size()) + " samples");
  }
  const double width_s = kernel_width_s(std::span(track.times_s).first(known), config);
  std::vector<MotionState> states;
  states.reserve(times_s.size());
  for (double t : times_s) states.push_back(local_line(track, t, known, width_s));
  return states;
}

CurbTrajectory observe(const Trajectory& track, std::size_t last, const CurbFrame& frame, double observe_s,
                       const SamplingConfig& config) {
  std::vector<double> times_s = observed_times_s(track, last, observe_s, config.interval_s);
  const std::vector<MotionState> states = smooth(track, times_s, last + 1, config);
  return in_frame(track, frame, std::move(times_s), states);
}

CurbTrajectory resample(const Trajectory& track, const CurbFrame& frame, const SamplingConfig& config) {
  validate(track);
  std::vector<double> times_s;
  const double start = track.times_s.front(), end = track.times_s.back();
  for (long k = 0; start + static_cast<double>(k) * config.interval_s <= end + kTimeSlack_s; ++k) {
    times_s.push_back(start + static_cast<double>(k) * config.interval_s);
  }
  const std::vector<MotionState> states = smooth(track, times_s, track.times_s.size(), config);
  return in_frame(track, frame, std::move(times_s), states);
}

std::vector<Vector2> past(const Trajectory& track, std::size_t last, double observe_s, const SamplingConfig& config) {
  std::vector<Vector2> path_m;
  for (const double time_s : observed_times_s(track, last, observe_s, config.interval_s))
    path_m.push_back(raw_position_m(track, time_s));
  return path_m;
}

std::vector<Vector2> future(const Trajectory& track, std::size_t last, std::size_t steps,
                            const SamplingConfig& config) {
  std::vector<Vector2> path_m;
  for (std::size_t j = 1; j <= steps; ++j) {
    const double time_s = track.times_s.at(last) + static_cast<double>(j) * config.interval_s;
    if (time_s > track.times_s.back() + kTimeSlack_s) break;
    path_m.push_back(raw_position_m(track, time_s));
  }
  return path_m;
}

std::optional<double> next_due_s(double due_s, double time_s, double every_s) {
  if (time_s < due_s - kTimeSlack_s) return std::nullopt;
  if (every_s <= 0.0) return time_s;
  while (due_s <= time_s + kTimeSlack_s) due_s += every_s;
  return due_s;
}

std::vector<std::size_t> prediction_samples(const Trajectory& track, double observe_s, double every_s) {
  if (!(every_s > 0.0)) throw std::invalid_argument("prediction_samples: every_s must be positive");
  validate(track);
  std::vector<std::size_t> samples;
  double due = track.times_s.front() + observe_s;
  for (std::size_t i = 0; i < track.times_s.size(); ++i) {
    const std::optional<double> next_s = next_due_s(due, track.times_s[i], every_s);
    if (!next_s) continue;
    samples.push_back(i);
    due = *next_s;
  }
  return samples;
}

}  // namespace sila
