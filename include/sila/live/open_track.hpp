#pragma once

#include <optional>
#include <vector>

#include "sila/core/clean.hpp"

namespace sila {

/// A track that may still go on. Invariant: `path` is the last of the trajectories that `clean` makes of `rows`, or
/// empty if it makes none, so that a stream and a file are cleaned alike.
struct OpenTrack {
  std::vector<Detection> rows;  ///< as they came; a mere repetition of the last is left out
  Trajectory path;
  double latest_s = 0.0;  ///< newest stamp of the rows
};

/// Whether `clean` could use such a row at all.
bool is_usable(const Detection& row, const CleanConfig& config);

/// Takes in a usable row of this track; says whether the path ends with it now, so that it can be predicted from there.
/// Constant time while rows come in order and go on without a jump; else as long as the track.
bool extend(OpenTrack& track, const Detection& row, const CleanConfig& config);

/// All of its trajectories, as `clean` makes them.
std::vector<Trajectory> trajectories_of(const OpenTrack& track, const CleanConfig& config);

}  // namespace sila
