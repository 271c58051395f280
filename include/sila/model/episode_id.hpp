#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <string>

#include "sila/core/framed_trajectory.hpp"

namespace sila {

/// 128 bits that stand for what an episode was learnt from.
struct EpisodeId {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  auto operator<=>(const EpisodeId&) const = default;
};

/// The same tracks at the same corners have the same id, whatever they are called and in whatever order they come; a
/// bit that differs makes another one. The same on every machine.
EpisodeId episode_id(std::span<const FramedTrajectory> batch);

/// 32 hexadecimal digits; they sort as the ids do.
std::string to_text(const EpisodeId& id);
/// Throws: std::invalid_argument for anything but 32 hexadecimal digits.
EpisodeId episode_id_of(const std::string& text);

}  // namespace sila
