#pragma once

#include "sila/service/stream.hpp"

namespace sila {

/// The longest gap after the path that does not cut the track [s].
double longest_gap_s(const OpenTrack& track, const CleanConfig& config);

/// Whether `clean` could use this row at all.
bool is_usable(const Detection& row, const CleanConfig& config);

/// Adds a usable row; true if the path ends with it, so that a prediction can start there.
/// Constant time while rows come in order and without a jump; otherwise proportional to the length of the track.
bool extend(OpenTrack& track, const Detection& row, const CleanConfig& config);

/// All trajectories that `clean` makes of the track.
std::vector<Trajectory> trajectories_of(const OpenTrack& track, const CleanConfig& config);

}  // namespace sila
