#include <algorithm>
#include <set>

#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"

namespace sila {

Forecast forecast_of(const RecordedPredictions& recorded) {
  return [&recorded](const CurbTrajectory& observed) {
    for (const std::string& track : {observed.id, person_of(observed.id)}) {
      const auto found = recorded.find({track, observed.times_s.back()});
      if (found != recorded.end()) return found->second;
    }
    return Prediction{};
  };
}

std::size_t count_without_track(const RecordedPredictions& recorded, std::span<const FramedTrajectory> tracks) {
  std::set<std::pair<std::string, double>> samples;
  for (const FramedTrajectory& placed : tracks) {
    for (const std::string& id : {placed.track.id, person_of(placed.track.id)}) {
      for (const double t_s : placed.track.times_s) samples.emplace(id, t_s);
    }
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(recorded, [&](const auto& entry) { return !samples.contains(entry.first); }));
}

}  // namespace sila
