#pragma once

#include <filesystem>
#include <string>

#include "sila/core/camera.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// How a prediction is written as a line (docs/formats.md).
struct LineFormat {
  bool v1 = false;  ///< the first form: the times in each mode, every number in full
  /// Decimals of metres and seconds; shares, levels and covariances get one more. From 17 on every number is written in
  /// full: the shortest text that reads back as the same double.
  int digits = 3;
  bool outcomes = false;  ///< probabilities of sila/refine/outcomes.hpp
};

/// A prediction as one line of JSON without the line's end: seconds, metres, world frame; times after t0; covariances
/// as [xx, xy, yy], positive definite as written. With a camera also in the image, `u`, `v` and `cov_uv` [pixels]; null
/// behind it. t0 and the probabilities of regions are always in full.
/// Throws: std::invalid_argument for digits outside [1, 17].
std::string prediction_line(const std::string& track, const Prediction& prediction,
                            const Explanation* explanation = nullptr, const Camera* camera = nullptr,
                            const LineFormat& format = {});

/// Reads predictions of both forms; lines of other kinds (events of a live service) are skipped.
/// Throws: FormatError, with the line, for one that begins like a prediction and is none.
RecordedPredictions read_predictions(const std::filesystem::path& path);

}  // namespace sila
