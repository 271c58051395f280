#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "sila/io/model_file.hpp"
#include "sila/live/online_calibration.hpp"

namespace sila {

nlohmann::ordered_json to_json(const OnlineCalibration& online_calibration);

/// The online calibration that the last episode was kept with; none if there is none, or it is none.
OnlineCalibration last_calibration(std::span<const EpisodeRecord> episodes);

}  // namespace sila
