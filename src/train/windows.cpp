#include <algorithm>
#include <cmath>
#include <utility>

#include "sila/core/sampling.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

constexpr double kSlack_s = 1e-6;

/// The part of a track until sample `last`, cut as if the person had appeared `seconds` before that sample.
Trajectory as_if_appeared(const Trajectory& track, std::size_t last, double seconds) {
  const auto begin = track.times_s.begin();
  const auto later =
      std::upper_bound(begin, begin + static_cast<std::ptrdiff_t>(last), track.times_s[last] - seconds + kSlack_s);
  const auto from = std::max<std::ptrdiff_t>(1, later - begin) - 1, end = static_cast<std::ptrdiff_t>(last) + 1;
  Trajectory recent{track.id, {begin + from, begin + end}, {}, track.recording};
  recent.positions_m.assign(track.positions_m.begin() + from, track.positions_m.begin() + end);
  return recent;
}

/// The window whose t0 is sample `last`. If `observed_s` is below `predict.observe_s`, it is cut as if the person had
/// appeared that many whole intervals before t0.
Window window_at(const FramedTrajectory& framed, std::size_t last, double observed_s, const PresentPeople& present,
                 const SamplingConfig& sampling, const RefineConfig& predict) {
  std::vector<Vector2> future_m =
      future(framed.track, last, static_cast<std::size_t>(steps_in(predict.horizon_s, sampling.interval_s)), sampling);
  const bool whole = observed_s >= predict.observe_s;
  observed_s = sampling.interval_s * std::floor(observed_s / sampling.interval_s + 1e-6);
  const Trajectory recent = whole ? framed.track : as_if_appeared(framed.track, last, observed_s);
  const std::size_t end = whole ? last : recent.times_s.size() - 1;
  const double reach_s = whole ? predict.observe_s : std::min(observed_s + sampling.interval_s, predict.observe_s);
  return {present.observe(recent, end, framed.frame, reach_s, sampling), past(recent, end, reach_s, sampling),
          std::move(future_m)};
}

}  // namespace

std::vector<Window> windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const RefineConfig& predict, double stride_s, std::span<const double> observed_s,
                               const PresentPeople* present) {
  const PresentPeople own(present ? std::span<const FramedTrajectory>() : tracks);
  if (!present) present = &own;
  std::vector<Window> windows;
  for (const FramedTrajectory& framed : tracks) {
    for (std::size_t last : prediction_samples(framed.track, predict.observe_s, stride_s)) {
      const double seconds = observed_s.empty() ? predict.observe_s : observed_s[windows.size() % observed_s.size()];
      windows.push_back(window_at(framed, last, seconds, *present, sampling, predict));
    }
  }
  return windows;
}

std::vector<Window> first_windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                                     const RefineConfig& predict, std::span<const double> observed_s,
                                     const PresentPeople& present) {
  std::vector<Window> windows;
  for (const FramedTrajectory& framed : tracks) {
    const std::vector<double>& times_s = framed.track.times_s;
    for (const double seconds : observed_s) {
      const double due_s = times_s.front() + seconds - kSlack_s;
      const auto last = std::ranges::lower_bound(times_s, due_s);
      if (last == times_s.end() || *last - due_s > sampling.interval_s) continue;  // a gap: no window of this age
      windows.push_back(
          window_at(framed, static_cast<std::size_t>(last - times_s.begin()), seconds, present, sampling, predict));
    }
  }
  return windows;
}

}  // namespace sila
