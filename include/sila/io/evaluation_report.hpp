#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "sila/evaluate/evaluate.hpp"

namespace sila {

/// Every metric under its name.
nlohmann::ordered_json to_json(const Metrics& metrics);

/// The means of each group at each horizon, the skipped tracks by reason; every metric under its name in `Metrics`.
nlohmann::ordered_json to_json(const Evaluation& evaluation);

/// The same for people: one line a group and horizon, the model beside constant velocity.
std::string to_text(const Evaluation& evaluation);

}  // namespace sila
