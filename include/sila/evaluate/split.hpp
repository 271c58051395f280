#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// The person of a track: tracklets of one person are "17", "17#2", ...
std::string person_of(const std::string& track_id);

/// How people are held back.
enum class SplitBy {
  time,   ///< a block of time, with an embargo around it: companions never leak
  track,  ///< people at random: companions of a held-back person are learnt from
};
inline constexpr const char* kSplitBy[] = {"time", "track"};

/// Embargo [s]: training leaves out pedestrians who were present within this time of a held-back block.
inline constexpr double kEmbargo_s = 5.0;

/// Tracks to learn from, in the order of learning, and tracks held back.
struct Split {
  std::vector<FramedTrajectory> train;
  std::vector<FramedTrajectory> test;
};

/// Holds back a share of the people, never single windows; tracklets of one person stay on one side.
/// By time: recordings are laid end to end in the seed's order, and from a place that the seed draws on, the first
/// people are held back. Their block of time ends a usual stay (of three quarters of the people) after the last of them
/// came, and their tracks with it. Of the others those whom the embargo parts from every such block of their recording
/// are learnt from, by recording and begin. By track: people in the seed's order, the first are held back. The same
/// seed gives the same split on every machine. Throws: std::invalid_argument for a share outside [0, 1), and by time
/// for a single recording without a clock: all of its tracks begin at one instant.
Split split_tracks(std::vector<FramedTrajectory> tracks, double test_share, std::uint64_t seed, SplitBy by);

/// The same with a number of people to hold back.
Split split_people(std::vector<FramedTrajectory> tracks, std::size_t test_people, std::uint64_t seed, SplitBy by);

}  // namespace sila
