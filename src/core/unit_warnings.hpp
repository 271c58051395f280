#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Warnings about units: positions that look like pixels or centimetres, stamps that look like frames or milliseconds.
/// Compares the speed and the extent of the tracks of one source, before anything was split; silent on pedestrians in
/// metres and seconds. Source: own rule, docs/decisions/0021.
std::vector<std::string> unit_warnings(std::span<const Trajectory> tracks, double max_gap_s);

/// Of each track that walks its median speed [positions' unit per second], whatever that unit is: a track that lasts
/// 3 s or more and gets at least half as far as its displacements over a second add up to. Noise of one who stands adds
/// up and gets nowhere.
std::vector<double> walking_speeds(std::span<const Trajectory> tracks);

/// The value below which the share `q` of them lies; 0 for none.
double quantile(std::vector<double> values, double q);

/// Fewer walking tracks say nothing about a unit.
inline constexpr std::size_t kFewestWalking = 5;

}  // namespace sila
