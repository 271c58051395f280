#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "sila/evaluate/evaluate.hpp"

namespace sila {

/// Predictions that were written as lines of JSON (docs/formats.md), by track and t0.
using RecordedPredictions = std::map<std::pair<std::string, double>, Prediction>;

/// Reads predictions; lines of other kinds (what a live service tells) are passed over.
/// Throws: FormatError, with the line, for one that begins like a prediction and is none.
RecordedPredictions read_predictions(const std::filesystem::path& path);

/// The recorded prediction of a track (by its id, or the id before "#") at the end of what was observed.
Forecast forecast_of(const RecordedPredictions& recorded);

}  // namespace sila
