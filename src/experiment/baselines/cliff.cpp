#include "sila/experiment/baselines/cliff.hpp"

#include <tbb/parallel_for.h>

#include <bit>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "samples.hpp"

namespace sila {
namespace {

std::pair<int, int> cell_at(const Vector2& position_m, double cell_m) {
  return {static_cast<int>(std::floor(position_m.x() / cell_m)), static_cast<int>(std::floor(position_m.y() / cell_m))};
}

/// Uniform in (0, 1), with the same bits everywhere.
double uniform(std::mt19937_64& random) {
  return (static_cast<double>(random() >> 11) + 0.5) * 0x1.0p-53;
}

/// Two independent standard normal numbers (Box and Muller).
Vector2 standard_normal(std::mt19937_64& random) {
  const double radius = std::sqrt(-2.0 * std::log(uniform(random)));
  const double angle = 2.0 * std::numbers::pi * uniform(random);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// (direction, speed), the speed not negative.
Vector2 drawn(const std::vector<SemiWrappedGaussian>& mixture, std::mt19937_64& random) {
  double rest = uniform(random);
  std::size_t k = 0;
  while (k + 1 < mixture.size() && rest >= mixture[k].weight) rest -= mixture[k++].weight;
  const Matrix2& c = mixture[k].covariance;
  const Vector2 normal = standard_normal(random);
  const double l11 = std::sqrt(c(0, 0)), l21 = c(1, 0) / l11;
  const double l22 = std::sqrt(std::max(0.0, c(1, 1) - l21 * l21));
  const Vector2 sample = mixture[k].mean + Vector2(l11 * normal.x(), l21 * normal.x() + l22 * normal.y());
  return {wrapped_rad(sample.x()), std::max(0.0, sample.y())};
}

/// The busiest of the cells near a place; null if none is near.
const CliffMap::Cell* busiest_near(const CliffMap& map, const Vector2& position_m, const CliffConfig& config) {
  const int reach = static_cast<int>(std::ceil(config.radius_m / config.cell_m));
  const auto [x, y] = cell_at(position_m, config.cell_m);
  const CliffMap::Cell* busiest = nullptr;
  for (int i = x - reach; i <= x + reach; ++i) {
    for (int j = y - reach; j <= y + reach; ++j) {
      const Vector2 centre_m = config.cell_m * Vector2(i + 0.5, j + 0.5);
      if ((centre_m - position_m).norm() > config.radius_m) continue;
      const auto found = map.cells.find({i, j});
      if (found == map.cells.end()) continue;
      if (busiest == nullptr || found->second.samples.size() > busiest->samples.size()) busiest = &found->second;
    }
  }
  return busiest;
}

/// (direction, speed) of the observed velocities, the latest weighing the most; in the map's metres.
Vector2 own_velocity(const CliffMap& map, const CurbTrajectory& observed, double sigma_s) {
  Vector2 sum = Vector2::Zero();
  double weights = 0.0;
  for (std::size_t t = 0; t < observed.times_s.size(); ++t) {
    const double past = (observed.times_s.back() - observed.times_s[t]) / sigma_s;
    const double weight = std::exp(-0.5 * past * past);
    sum += weight * velocity_to_world(map.frame, observed.velocities[t]), weights += weight;
  }
  sum /= weights;
  return {std::atan2(sum.y(), sum.x()), sum.norm()};
}

/// A number that the observed path and the seed alone decide (FNV-1a over its bits).
std::uint64_t seed_of(const CurbTrajectory& observed, std::uint64_t seed) {
  std::uint64_t hash = 14695981039346656037ull ^ seed;
  for (const Vector2& position : observed.positions) {
    for (double value : {position.x(), position.y()}) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ull;
      hash ^= hash >> 29;
    }
  }
  return hash;
}

/// One path through the map [m of the map], `held` steps on each draw.
std::vector<Vector2> walked(const CliffMap& map, Vector2 position_m, Vector2 velocity, int steps, double interval_s,
                            const CliffConfig& config, std::mt19937_64& random) {
  const int held = std::max(1, static_cast<int>(std::lround(config.step_s / interval_s)));
  const auto trust = [&](double off) { return std::exp(-config.beta * off * off); };
  std::vector<Vector2> path;
  for (int j = 0; j < steps; ++j) {
    const CliffMap::Cell* cell = j % held == 0 ? busiest_near(map, position_m, config) : nullptr;
    if (cell != nullptr) {
      const Vector2 sample = drawn(cell->mixture, random);
      const double turn = wrapped_rad(sample.x() - velocity.x()), faster = sample.y() - velocity.y();
      velocity += Vector2(turn * trust(turn), faster * trust(faster));
    }
    position_m += interval_s * velocity.y() * Vector2(std::cos(velocity.x()), std::sin(velocity.x()));
    path.push_back(position_m);
  }
  return path;
}

}  // namespace

CliffMap map_dynamics(CliffMap map, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                      const CliffConfig& cliff) {
  validate_fields("map_dynamics", cliff);
  if (map.cells.empty() && !tracks.empty()) map.frame = tracks.front().frame;
  std::set<std::pair<int, int>> touched;
  for (const FramedTrajectory& placed : tracks) {
    const CurbTrajectory track = resample(placed.track, placed.frame, config.sampling);
    for (std::size_t t = 0; t < track.positions.size(); ++t) {
      const Vector2 velocity = velocity_to_world(map.frame, track.velocities[t]);
      if (velocity.norm() < cliff.least_speed_mps) continue;
      const auto key = cell_at(to_world(map.frame, track.positions[t]), cliff.cell_m);
      map.cells[key].samples.emplace_back(std::atan2(velocity.y(), velocity.x()), velocity.norm());
      touched.insert(key);
    }
  }
  std::vector<CliffMap::Cell*> changed;
  for (const auto& key : touched) changed.push_back(&map.cells.at(key));
  tbb::parallel_for(std::size_t{0}, changed.size(),
                    [&](std::size_t i) { changed[i]->mixture = fit_semi_wrapped(changed[i]->samples); });
  return map;
}

std::size_t size(const CliffMap& map) {
  std::size_t sum = 0;
  for (const auto& [key, cell] : map.cells) sum += cell.mixture.size();
  return sum;
}

Prediction predict(const CliffMap& map, const CurbTrajectory& observed, int steps, double interval_s,
                   const CliffConfig& config) {
  if (map.cells.empty()) return constant_fallback(observed, steps, interval_s);
  std::mt19937_64 random(seed_of(observed, config.seed));
  const Vector2 start_m = to_world(map.frame, observed.positions.back());
  const Vector2 velocity = own_velocity(map, observed, config.velocity_sigma_s);
  std::vector<Mode> modes;
  for (int n = 0; n < config.rollouts; ++n) {
    Mode mode{1.0, {}, {}, {}};
    for (const Vector2& position_m : walked(map, start_m, velocity, steps, interval_s, config, random)) {
      mode.path_m.push_back(to_world(observed.frame, to_curb(map.frame, position_m)));
    }
    modes.push_back(std::move(mode));
  }
  return from_samples(observed.times_s.back(), interval_s, std::move(modes));
}

}  // namespace sila
