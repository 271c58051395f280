#pragma once

#include <span>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Warnings about units: positions that look like pixels or centimetres, stamps that look like frames or milliseconds.
/// Compares the speed and the extent of the tracks of one source, before anything was split; silent on pedestrians in
/// metres and seconds. Source: own rule, docs/decisions/0021.
std::vector<std::string> unit_warnings(std::span<const Trajectory> tracks, double max_gap_s);

}  // namespace sila
