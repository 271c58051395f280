#pragma once

#include <filesystem>
#include <span>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Writes the generic CSV, header `track_id,t,x,y`; every number reads back as the same double. The file appears whole
/// or not at all. Units: seconds, metres. Throws: FormatError if the path cannot be written.
void write_tracks_csv(const std::filesystem::path& path, std::span<const Trajectory> tracks);

}  // namespace sila
