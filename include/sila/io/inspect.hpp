#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "sila/io/model_store.hpp"

namespace sila {

/// A stored model in about a dozen lines for people.
std::string describe(const StoredModel& stored);

/// The same for programs: primitives, transitions, size, episodes, tracks, bytes and more.
nlohmann::ordered_json inspect_json(const StoredModel& stored);

}  // namespace sila
