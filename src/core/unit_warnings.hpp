#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// "clean.max_gap_s=3": in whole seconds twice the median of the gaps longer than `max_gap_s`, so that one missing
/// sample cuts no slow track. Without a value if there is no such gap, or beyond the range of the setting.
std::string gap_setting(std::span<const Trajectory> tracks, double max_gap_s);

/// Warnings about units: positions that look like pixels or centimetres, stamps that look like frames or milliseconds.
/// Compares the speed and the extent of the tracks of one source, before anything was split; silent on pedestrians in
/// metres and seconds. `live`: the remedies are those of a stream, not of a file. Source: own rule,
/// docs/decisions/0021.
std::vector<std::string> unit_warnings(std::span<const Trajectory> tracks, double max_gap_s, bool live = false);

/// The median speed of each track that walks, without its pauses [unit of the positions per second]. A track walks if
/// it lasts 3 s or more and its net displacement is at least half of the sum of its displacements over one second.
/// Noise gives a standing person a large sum and a small net displacement.
std::vector<double> walking_speeds(std::span<const Trajectory> tracks);

/// The value below which the share `q` of them lies; 0 for none.
double quantile(std::vector<double> values, double q);

/// Fewer walking tracks say nothing about a unit.
inline constexpr std::size_t kFewestWalking = 5;

}  // namespace sila
