#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "sila/core/detections.hpp"

namespace sila {

/// One row of a tracker as JSON, `{"t": 12.3, "id": "a", "x": 1.5, "y": 2.0}`: seconds, metres, an id of 1 to 64 bytes
/// or a whole number, and a `label` if there is one. Nothing for JSON that is something else.
std::optional<Detection> detection_of(const nlohmann::json& json);

}  // namespace sila
