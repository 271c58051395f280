#include <algorithm>
#include <cmath>

#include "walker.hpp"

namespace sila::sim {
namespace {

constexpr double kShortest_s = 2.0;       ///< shorter tracks are not reported
constexpr double kNoiseMemory_s = 0.8;    ///< of the correlated part of the noise
constexpr double kCorrelatedShare = 0.7;  ///< of the variance

/// Samples [first, last] of a walker.
struct Span {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::size_t samples_in(double duration_s, const SimulationConfig& config) {
  return static_cast<std::size_t>(duration_s / config.sample_interval_s + 0.5);
}

bool long_enough(const Span& span, const SimulationConfig& config) {
  return span.last > span.first && span.last - span.first >= std::max<std::size_t>(1, samples_in(kShortest_s, config));
}

/// The longest unbroken stay in view; where a tracker finds and loses people varies.
Span longest_stay(const std::vector<Vector2>& samples_m, const IntersectionScene& scene, Random& random) {
  const double found_m = scene.view_radius_m * random.uniform(0.85, 1.0),
               lost_m = scene.view_radius_m * random.uniform(0.85, 1.0);
  const Vector2& eye = primary_corner(scene).frame.origin_m;
  Span best, stay;
  bool in_view = false;
  for (std::size_t k = 0; k < samples_m.size(); ++k) {
    const double distance = (samples_m[k] - eye).norm();
    // Two radii make a hysteresis: no track flickers at the border.
    const bool now = distance < std::min(found_m, lost_m) || (in_view && distance < lost_m);
    if (now && !in_view) stay.first = k;
    if (now) stay.last = k;
    if (now && stay.last - stay.first > best.last - best.first) best = stay;
    in_view = now;
  }
  return best;
}

/// Lost or found in mid view, or lost and found again under another id.
std::vector<Span> cut(const Span& stay, const SimulationConfig& config, Random& random) {
  if (!random.chance(config.cut_share)) return {stay};
  const double length = static_cast<double>(stay.last - stay.first);
  const auto part = [&](double share) { return static_cast<std::size_t>(length * share); };
  const double kind = random.uniform();
  const double where = random.uniform(0.25, 0.75);
  if (kind < 0.35) return {{stay.first + part(where), stay.last}};
  if (kind < 0.7) return {{stay.first, stay.first + part(where)}};
  const std::size_t again = stay.first + part(where) + 1 + samples_in(random.uniform(0.2, 1.5), config);
  if (again >= stay.last) return {stay};
  return {{stay.first, stay.first + part(where)}, {again, stay.last}};
}

/// The samples that are not occluded; the ends of a track are seen by definition.
std::vector<std::size_t> unoccluded(const Span& span, const SimulationConfig& config, Random& random) {
  std::vector<std::size_t> seen;
  const double rate = config.occlusions_per_min / 60.0 * config.sample_interval_s;
  std::size_t hidden = 0;
  for (std::size_t k = span.first; k <= span.last; ++k) {
    if (hidden == 0 && random.chance(rate)) hidden = samples_in(random.uniform(0.3, 1.6), config);
    if (hidden == 0 || k == span.first || k == span.last) seen.push_back(k);
    if (hidden > 0) --hidden;
  }
  return seen;
}

/// White noise plus a first-order process, together of the configured variance.
std::vector<Vector2> measure(const std::vector<Vector2>& samples_m, const std::vector<std::size_t>& seen,
                             const SimulationConfig& config, Random& random) {
  const double slow_m = config.noise_std_m * std::sqrt(kCorrelatedShare);
  const double white_m = config.noise_std_m * std::sqrt(1.0 - kCorrelatedShare);
  std::vector<Vector2> measured;
  measured.reserve(seen.size());
  const auto draw = [&](double spread) {
    const double x = random.normal();
    return Vector2(spread * x, spread * random.normal());
  };
  Vector2 slow = draw(slow_m);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (i > 0) {
      const double gap_s = static_cast<double>(seen[i] - seen[i - 1]) * config.sample_interval_s;
      const double kept = std::max(0.0, 1.0 - gap_s / kNoiseMemory_s);
      slow = kept * slow + draw(slow_m * std::sqrt(1.0 - kept * kept));
    }
    measured.push_back(samples_m[seen[i]] + slow + draw(white_m));
  }
  return measured;
}

}  // namespace

std::vector<Sighting> track_walker(const std::vector<Vector2>& samples_m, const IntersectionScene& scene,
                                   const SimulationConfig& config, Random& random) {
  std::vector<Sighting> sightings;
  const Span stay = longest_stay(samples_m, scene, random);
  if (!long_enough(stay, config)) return sightings;
  for (const Span& span : cut(stay, config, random)) {
    if (!long_enough(span, config)) continue;
    Sighting sighting{span.first, span.last, unoccluded(span, config, random), {}};
    sighting.measured_m = measure(samples_m, sighting.seen, config, random);
    sightings.push_back(std::move(sighting));
  }
  return sightings;
}

}  // namespace sila::sim
