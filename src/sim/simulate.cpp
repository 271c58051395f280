#include "sila/sim/simulate.hpp"

#include <algorithm>
#include <cmath>

#include "core/indices.hpp"
#include "street_plan.hpp"
#include "walker.hpp"

namespace sila {
namespace {

using sim::Random;
using sim::Walker;

constexpr double kLongestStep_s = 0.1;
constexpr double kLongestStay_s = 300.0;  ///< whoever is under way for longer is stuck in a crowd and leaves the scene

/// Streams of random numbers: the arrivals have the first, each walker three of the others.
enum Purpose : std::uint64_t { arrivals = 0, habits = 1, step_motion = 2, tracking = 3 };
std::uint64_t stream(Purpose purpose, std::size_t walker = 0) {
  return 3 * walker + purpose;
}

struct World {
  sim::StreetPlan plan;
  IntersectionScene scene;
  Random arrivals;
  std::vector<Walker> walkers;
  std::size_t arrived = 0;
  std::size_t parties = 0;
  Simulation result;                      ///< in the order in which walkers leave
  std::vector<std::size_t> first_sample;  ///< of each track
};

/// One person, or two or three side by side.
void admit_party(World& world, const SimulationConfig& config, std::size_t sample) {
  Random leader(config.seed, stream(habits, world.arrived));
  const sim::Route way = draw_route(world.plan, config, leader);
  const double speed = std::clamp(config.mean_speed_mps + config.speed_std_mps * leader.normal(), 0.6, 2.2);
  const double reaction_s = leader.uniform(0.3, 1.6);
  const std::size_t size = leader.chance(config.group_share) ? (leader.chance(0.25) ? 3 : 2) : 1;
  for (std::size_t member = 0; member < size; ++member) {
    // To the right and to the left of the first.
    const double offset = member == 0 ? 0.0 : (member == 1 ? -0.65 : 0.65);
    Walker walker(member == 0 ? way : beside(way, world.plan, offset),
                  Random(config.seed, stream(step_motion, world.arrived)));
    walker.party = world.parties;
    walker.speed_mps = speed;
    walker.reaction_s = reaction_s + 0.2 * static_cast<double>(member);
    walker.first_sample = sample;
    walker.route.traits.walker = world.arrived++;
    walker.route.traits.free_speed_mps = speed;
    walker.route.traits.in_group = size > 1;
    const std::vector<Vector2>& path = walker.route.path;
    walker.position = path.front();
    walker.velocity = speed * (path[1] - path[0]).normalized();
    world.walkers.push_back(std::move(walker));
  }
  ++world.parties;
}

void report(World& world, const Walker& walker, const SimulationConfig& config) {
  Random random(config.seed, stream(tracking, walker.route.traits.walker));
  const auto time_of = [&](std::size_t k) {
    return static_cast<double>(walker.first_sample + k) * config.sample_interval_s;
  };
  for (const sim::Sighting& sighting : track_walker(walker.samples, world.scene, config, random)) {
    Trajectory track, truth;
    for (std::size_t k : sighting.seen) track.times_s.push_back(time_of(k));
    track.positions_m = sighting.measured_m;
    for (std::size_t k = sighting.first; k <= sighting.last; ++k) {
      truth.times_s.push_back(time_of(k));
      truth.positions_m.push_back(walker.samples[k]);
    }
    world.result.tracks.push_back(std::move(track));
    world.result.truth.push_back(std::move(truth));
    world.result.traits.push_back(walker.route.traits);
    world.first_sample.push_back(walker.first_sample + sighting.first);
  }
}

void record(World& world, const SimulationConfig& config, std::size_t sample) {
  const auto longest = static_cast<std::size_t>(kLongestStay_s / config.sample_interval_s);
  const auto leaves = [&](const Walker& walker) { return finished(walker) || sample - walker.first_sample > longest; };
  for (Walker& walker : world.walkers) walker.samples.push_back(walker.position);
  for (const Walker& walker : world.walkers)
    if (leaves(walker)) report(world, walker, config);
  std::erase_if(world.walkers, leaves);
}

/// The first `count` tracks by start time, named by their rank.
Simulation in_order(World world, std::size_t count) {
  std::vector<std::size_t> order = indices(world.first_sample.size());
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return world.first_sample[i]; });
  Simulation sorted;
  sorted.scene = std::move(world.scene);
  for (std::size_t rank = 0; rank < count; ++rank) {
    const std::size_t i = order[rank];
    sorted.tracks.push_back(std::move(world.result.tracks[i]));
    sorted.truth.push_back(std::move(world.result.truth[i]));
    sorted.traits.push_back(world.result.traits[i]);
    sorted.tracks.back().id = sorted.truth.back().id = std::to_string(rank + 1);
  }
  return sorted;
}

}  // namespace

Simulation simulate(const SimulationConfig& config) {
  validate_fields("simulate", config);
  World world{
      sim::make_street_plan(config), simulated_scene(config), Random(config.seed, stream(arrivals)), {}, 0, 0, {}, {}};
  const auto wanted = static_cast<std::size_t>(config.tracks);
  const auto steps = static_cast<std::size_t>(std::ceil(config.sample_interval_s / kLongestStep_s - 1e-9));
  const double step_s = config.sample_interval_s / static_cast<double>(steps);
  // Arrivals end when enough tracks are complete; those still under way may have begun earlier than the last of them.
  for (std::size_t sample = 0; world.result.tracks.size() < wanted || !world.walkers.empty(); ++sample) {
    const bool open = world.result.tracks.size() < wanted;
    if (open && world.arrivals.chance(config.arrivals_per_s * config.sample_interval_s))
      admit_party(world, config, sample);
    record(world, config, sample);
    for (std::size_t i = 0; i < steps; ++i) {
      const double time_s = static_cast<double>(sample) * config.sample_interval_s + static_cast<double>(i) * step_s;
      sim::step(world.walkers, world.plan, config, time_s, step_s);
    }
  }
  return in_order(std::move(world), wanted);
}

}  // namespace sila
