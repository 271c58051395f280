#include "sila/core/companions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"

namespace sila {
namespace {

/// A person whose last position is older is not present any more; interruptions of a tracker are shorter.
constexpr double kPresent_s = 0.5;
/// How near companions are, and how similar their velocities: standard deviations of a Gaussian weight.
constexpr double kNear_m = 1.0, kSimilar_mps = 0.5;
/// Weight of the belief that companions walk as the person does.
constexpr double kPriorWeight = 0.3;
constexpr double kStampSlack_s = 1e-6;

std::pair<std::size_t, double> begin_of(const Trajectory& track) {
  return {track.recording, track.times_s.front()};
}

}  // namespace

std::optional<MotionState> motion_at(const Trajectory& track, double time_s) {
  if (track.positions_m.size() != track.times_s.size())
    throw invalid_argument("motion_at: track '", track.id, "' has ", track.positions_m.size(),
                           " positions, must be as many as times, ", track.times_s.size());
  const auto begin = track.times_s.begin();
  const auto later = std::upper_bound(begin, track.times_s.end(), time_s + kStampSlack_s);
  if (later - begin < 2) return std::nullopt;
  const auto last = static_cast<std::size_t>(later - begin) - 1;
  const double last_s = track.times_s[last];
  if (time_s - last_s > kPresent_s) return std::nullopt;
  const auto first = std::min(
      last - 1, static_cast<std::size_t>(
                    std::lower_bound(begin, later, last_s - kConstantVelocityWindow_s - kStampSlack_s) - begin));
  const Vector2 velocity_mps = (track.positions_m[last] - track.positions_m[first]) / (last_s - track.times_s[first]);
  return MotionState{track.positions_m[last] + (time_s - last_s) * velocity_mps, velocity_mps};
}

Vector2 companions_mps(const MotionState& own, std::span<const MotionState> others) {
  double weights = kPriorWeight;
  Vector2 sum_mps = Vector2::Zero();
  for (const MotionState& other : others) {
    const Vector2 relative_mps = other.velocity_mps - own.velocity_mps;
    const double weight = std::exp(-0.5 * ((other.position_m - own.position_m).squaredNorm() / (kNear_m * kNear_m) +
                                           relative_mps.squaredNorm() / (kSimilar_mps * kSimilar_mps)));
    weights += weight;
    sum_mps += weight * relative_mps;
  }
  return sum_mps / weights;
}

Vector2 companions_mps(const Trajectory& track, std::size_t last, std::span<const Trajectory* const> others) {
  require_sample("companions_mps", track, last);
  const double t0_s = track.times_s[last];
  const std::optional<MotionState> own = motion_at(track, t0_s);
  if (!own) return Vector2::Zero();
  std::vector<MotionState> motions;
  for (const Trajectory* other : others) {
    if (const std::optional<MotionState> motion = motion_at(*other, t0_s)) motions.push_back(*motion);
  }
  return companions_mps(*own, motions);
}

PresentPeople::PresentPeople(std::span<const FramedTrajectory> tracks) {
  for (const FramedTrajectory& placed : tracks) {
    validate(placed.track);
    people_.push_back({&placed.track, placed.track.times_s.back()});
  }
  std::ranges::stable_sort(people_, {}, [](const Person& person) { return begin_of(*person.track); });
  for (std::size_t i = 1; i < people_.size(); ++i) {
    if (people_[i - 1].track->recording == people_[i].track->recording)
      people_[i].latest_s = std::max(people_[i].latest_s, people_[i - 1].latest_s);
  }
}

Vector2 PresentPeople::companions_mps(const Trajectory& track, std::size_t last) const {
  require_sample("companions_mps", track, last);
  const double t0_s = track.times_s[last];
  std::vector<const Trajectory*> others;
  auto person = std::ranges::upper_bound(people_, std::pair(track.recording, t0_s), {},
                                         [](const Person& other) { return begin_of(*other.track); });
  while (person != people_.begin()) {
    --person;
    if (person->track->recording != track.recording || person->latest_s < t0_s - kPresent_s) break;
    if (person->track->id != track.id) others.push_back(person->track);
  }
  return sila::companions_mps(track, last, others);
}

CurbTrajectory PresentPeople::observe(const Trajectory& track, std::size_t last, const CurbFrame& frame,
                                      double observe_s, const SamplingConfig& config) const {
  CurbTrajectory observed = sila::observe(track, last, frame, observe_s, config);
  observed.companions_mps = companions_mps(track, last);
  return observed;
}

}  // namespace sila
