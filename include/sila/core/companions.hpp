#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sila/core/sampling.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// Position of a person at `time_s`, and the mean velocity over the 0.8 s before it or what there is of them, by the
/// raw samples until then alone; none if the last of these is older than 0.5 s, or there is only one.
std::optional<MotionState> motion_at(const Trajectory& track, double time_s);

/// Mean velocity of a person's companions relative to the person's own [m/s], world frame: people count by how near
/// they are (1 m) and how similarly they walk (0.5 m/s). Zero without companions. `others`: the other people of the
/// moment. Source: none in the paper; docs/decisions/0124-companions.md.
Vector2 companions_mps(const MotionState& own, std::span<const MotionState> others);

/// The same of a track at its sample `last`, by what was seen of it and of `others` until then.
Vector2 companions_mps(const Trajectory& track, std::size_t last, std::span<const Trajectory* const> others);

/// The people of recordings by time.
class PresentPeople {
 public:
  /// Keeps the tracks by reference.
  explicit PresentPeople(std::span<const FramedTrajectory> tracks);

  /// Of the person of `track` at its sample `last`: those of the same recording with another id count. Nothing after
  /// that sample is used.
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
