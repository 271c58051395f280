#include "sila/experiment/baselines/memory.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "samples.hpp"
#include "sila/core/kinematics.hpp"
#include "sila/core/steps.hpp"

namespace sila {
namespace {

constexpr double kLastVelocity_s = 0.8;

/// Where and how a person moves, in the metres of `frame`, with no future yet.
RememberedWindow situation(const CurbFrame& frame, const CurbTrajectory& observed) {
  const auto velocity = [&](double window_s) {  // the same widths per second, in the metres of another place
    return velocity_to_world(frame, velocity_to_curb(observed.frame, mean_velocity_mps(observed, window_s)));
  };
  const double whole_s = observed.times_s.back() - observed.times_s.front();
  return {to_world(frame, observed.positions.back()), velocity(kLastVelocity_s), velocity(whole_s), {}};
}

double squared_distance(const RememberedWindow& a, const RememberedWindow& b, const MemoryConfig& config) {
  const auto term = [](const Vector2& difference, double scale) { return difference.squaredNorm() / (scale * scale); };
  return term(a.position_m - b.position_m, config.position_m) +
         term(a.velocity_mps - b.velocity_mps, config.velocity_mps) +
         term(a.mean_velocity_mps - b.mean_velocity_mps, config.mean_velocity_mps);
}

}  // namespace

TrackMemory remember(TrackMemory memory, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                     const MemoryConfig& memory_config) {
  validate_fields("remember", memory_config);
  if (memory.windows.empty() && !tracks.empty()) memory.frame = tracks.front().frame;
  const auto steps = static_cast<std::size_t>(steps_in(config.predict.horizon_s, config.sampling.interval_s));
  for (const Window& window : windows_of(tracks, config.sampling, config.predict, memory_config.every_s)) {
    if (window.future_m.size() != steps) continue;
    RememberedWindow remembered = situation(memory.frame, window.observed);
    const Vector2 start = window.observed.positions.back();
    for (const Vector2& position_m : window.future_m) {
      const Vector2 widths = to_curb(window.observed.frame, position_m) - start;
      remembered.displacements_m.push_back(velocity_to_world(memory.frame, widths));
    }
    memory.windows.push_back(std::move(remembered));
  }
  return memory;
}

Prediction predict(const TrackMemory& memory, const CurbTrajectory& observed, int steps, double interval_s,
                   const MemoryConfig& config) {
  if (memory.windows.empty()) return constant_fallback(observed, steps, interval_s);
  const RememberedWindow now = situation(memory.frame, observed);
  std::vector<std::pair<double, std::size_t>> distances(memory.windows.size());
  for (std::size_t i = 0; i < distances.size(); ++i) {
    distances[i] = {squared_distance(now, memory.windows[i], config), i};
  }
  const std::size_t count = std::min(distances.size(), static_cast<std::size_t>(config.neighbours));
  const auto last = distances.begin() + static_cast<std::ptrdiff_t>(count);
  std::partial_sort(distances.begin(), last, distances.end());
  const double reach = std::max(1e-6, distances[count - 1].first);  // the kernel is as wide as the neighbourhood
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  std::vector<Mode> modes;
  for (std::size_t n = 0; n < count; ++n) {
    Mode mode{std::exp(-distances[n].first / reach), {}, {}, {}};
    for (const Vector2& displacement_m : memory.windows[distances[n].second].displacements_m) {
      const Vector2 widths = velocity_to_curb(memory.frame, displacement_m);
      mode.path_m.emplace_back(start_m + velocity_to_world(observed.frame, widths));
    }
    modes.push_back(std::move(mode));
  }
  return from_samples(observed.times_s.back(), interval_s, std::move(modes));
}

}  // namespace sila
