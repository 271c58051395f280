#pragma once

#include <filesystem>
#include <string>

#include "sila/core/camera.hpp"
#include "sila/evaluate/recorded.hpp"
#include "sila/refine/explanation.hpp"

namespace sila {

/// A prediction as one line of JSON without the line's end (docs/formats.md): seconds, metres, world frame; times after
/// t0; covariances as [xx, xy, yy]. With a camera also in the image, `u`, `v` and `cov_uv` [pixels]; null behind it.
std::string prediction_line(const std::string& track, const Prediction& prediction,
                            const Explanation* explanation = nullptr, const Camera* camera = nullptr);

/// Reads predictions; lines of other kinds (events of a live service) are skipped.
/// Throws: FormatError, with the line, for one that begins like a prediction and is none.
RecordedPredictions read_predictions(const std::filesystem::path& path);

}  // namespace sila
