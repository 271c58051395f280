#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sila/core/sampling.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// Position of a person at `time_s`, and the mean velocity over the 0.8 s before it (less for a shorter track). Only
/// raw samples until `time_s` are used; null if the last of them is more than 0.5 s earlier, or there is only one.
/// Throws: std::invalid_argument unless there are as many positions as times.
std::optional<MotionState> motion_at(const Trajectory& track, double time_s);

/// Mean velocity of a person's companions relative to the person's own [m/s], world frame. `others`: all other people
/// present at that time; their weights fall with distance (scale 1 m) and difference of velocity (0.5 m/s). Zero
/// without companions. Source: none in the paper; docs/decisions/0124-companions.md.
Vector2 companions_mps(const MotionState& own, std::span<const MotionState> others);

/// The same for a track at its sample `last`; later samples of it and of `others` are not used. `others` must not have
/// the track itself. Throws: std::invalid_argument if there is no such sample; as motion_at.
Vector2 companions_mps(const Trajectory& track, std::size_t last, std::span<const Trajectory* const> others);

/// The people of recordings by time. For live tracks, which grow, use sila::companions_mps.
class PresentPeople {
 public:
  /// The tracks must outlive this object and not change. Throws: std::invalid_argument for a track that breaks its
  /// invariant.
  explicit PresentPeople(std::span<const FramedTrajectory> tracks);

  /// As sila::companions_mps, for `track` at its sample `last`: other people are the tracks of the same recording with
  /// another id. Nothing after that sample is used.
  Vector2 companions_mps(const Trajectory& track, std::size_t last) const;
  /// As sila::observe, with the companions.
  CurbTrajectory observe(const Trajectory& track, std::size_t last, const CurbFrame& frame, double observe_s,
                         const SamplingConfig& config) const;

 private:
  struct Person {
    const Trajectory* track;
    double latest_s;  ///< end of the last track of the recording among those that began until then
  };

  std::vector<Person> people_;  ///< by recording and begin
};

}  // namespace sila
