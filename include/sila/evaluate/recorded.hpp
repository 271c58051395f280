#pragma once

#include <map>
#include <string>
#include <utility>

#include "sila/evaluate/evaluate.hpp"

namespace sila {

/// Predictions by track and t0.
using RecordedPredictions = std::map<std::pair<std::string, double>, Prediction>;

/// The recorded prediction of a track (by its id, or the id before "#") at the end of what was observed.
Forecast forecast_of(const RecordedPredictions& recorded);

}  // namespace sila
