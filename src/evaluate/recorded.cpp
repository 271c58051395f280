#include <algorithm>
#include <map>

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
  std::multimap<std::string, const std::vector<double>*> times_s;
  for (const FramedTrajectory& placed : tracks) {
    for (const std::string& id : {placed.track.id, person_of(placed.track.id)})
      times_s.emplace(id, &placed.track.times_s);
  }
  return static_cast<std::size_t>(std::ranges::count_if(recorded, [&](const auto& entry) {
    const double t0_s = entry.first.second;
    const auto [first, last] = times_s.equal_range(entry.first.first);
    return std::none_of(first, last, [&](const auto& of) { return std::ranges::binary_search(*of.second, t0_s); });
  }));
}

}  // namespace sila
