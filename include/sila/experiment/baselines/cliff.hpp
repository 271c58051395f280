#pragma once

#include <concepts>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "sila/experiment/baselines/semi_wrapped.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// A map of dynamics and how it is walked through.
struct CliffConfig {
  double cell_m = 1.0;
  double radius_m = 1.0;
  double beta = 10.0;
  double step_s = 0.4;
  double velocity_sigma_s = 0.4;
  double least_speed_mps = 0.1;
  int rollouts = 20;
  std::uint64_t seed = 1;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, CliffConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("cell_m", config.cell_m, Range{0.1, 100.0}, "m", "size of the cells");
  visit.number("radius_m", config.radius_m, Range{0.0, 100.0, true}, "m",
               "cells whose centre is so near are asked; the busiest of them answers (r_s)");
  visit.number("beta", config.beta, Range{0.0, 1000.0}, "-", "trust in the person's own velocity against the map's");
  visit.number("step_s", config.step_s, Range{0.01, 10.0}, "s", "time between two draws from the map (Delta t)");
  visit.number("velocity_sigma_s", config.velocity_sigma_s, Range{0.01, 60.0}, "s",
               "width of the kernel that weighs the observed velocities, the latest the most (sigma)");
  visit.number("least_speed_mps", config.least_speed_mps, Range{0.0, 10.0}, "m/s",
               "slower samples have no direction and are left out of the map");
  visit.number("rollouts", config.rollouts, Range{1, 10000}, "-", "paths that a prediction is made of");
  visit.number("seed", config.seed, Range{0, 9e15}, "-", "of what is drawn");
}

/// Per cell a mixture over direction and speed. Other places are laid over the first one by their curb frames.
struct CliffMap {
  struct Cell {
    std::vector<Vector2> samples;  ///< (direction [rad], speed [m/s]); kept, so that the map can go on
    std::vector<SemiWrappedGaussian> mixture;
  };
  CurbFrame frame;
  std::map<std::pair<int, int>, Cell> cells;
};

/// The map with more tracks; the cells that they touch are fitted anew.
/// Throws: std::invalid_argument for a configuration out of range.
CliffMap map_dynamics(CliffMap map, std::span<const FramedTrajectory> tracks, const EpisodeConfig& config,
                      const CliffConfig& cliff);

/// How many Gaussians the map has.
std::size_t size(const CliffMap& map);

/// Paths drawn from the map, equally weighted. At each step a velocity is drawn from the mixture that is there, and the
/// person's velocity turns towards it, the less the more the two differ:
/// speed += (drawn - speed) exp(-beta (drawn - speed)²), direction alike.
/// The draws depend on the seed and on what was observed alone. Shapes: `steps` steps of `interval_s`.
/// Source: Zhu, Rudenko, Kucner, Palmieri, Arras, Lilienthal, Magnusson, "CLiFF-LHMP: Using Spatial Dynamics Patterns
/// for Long-Term Human Motion Prediction", IROS 2023; the map: Kucner et al., "Enabling Flow Awareness for Mobile
/// Robots in Partially Observable Environments", RA-L 2017. Differs: where no cell is near the velocity is kept,
/// instead of the prediction ending; the busiest cell stands for that with the highest motion ratio (all cells were
/// watched equally long); standing people are not in the map; beta 10 and
/// sigma 0.4 s, which served best on vru, students03 and zara01 (published: 1 and 1.5 s, for steps of 0.4 to 1 s).
Prediction predict(const CliffMap& map, const CurbTrajectory& observed, int steps, double interval_s,
                   const CliffConfig& config);

}  // namespace sila
