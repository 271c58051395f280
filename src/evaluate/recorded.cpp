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

}  // namespace sila
