#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "sila/io/model_store.hpp"

namespace sila {

/// The episodes of a model as a table, one a line: number, when, tracks, seconds, sizes, and what was added, fused,
/// split and lost ("-" where the file does not tell any more). `oldest`: the earliest that can be rolled back to.
std::string describe_log(const StoredModel& stored, int oldest);

/// The same for programs.
nlohmann::ordered_json log_json(const StoredModel& stored, int oldest);

}  // namespace sila
