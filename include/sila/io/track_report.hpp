#pragma once

#include <nlohmann/json_fwd.hpp>

#include "sila/core/clean.hpp"

namespace sila {

/// The report as JSON: the counts under their names, `dropped` as {reason: {rows, first}}, `warnings`.
nlohmann::json to_json(const TrackReport& report);

}  // namespace sila
