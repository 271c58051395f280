#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "sila/evaluate/compare.hpp"
#include "sila/io/model_file.hpp"

namespace sila {

/// A stored model in about a dozen lines for people.
std::string describe(const StoredModel& stored);

/// The same for programs: primitives, transitions, size, episodes, tracks, bytes and more.
nlohmann::ordered_json inspect_json(const StoredModel& stored);

/// The episodes of a model as a table, one a line: number, when, tracks, seconds, sizes, and how many primitives were
/// added, fused, split and lost ("-" where the record has no `change`). `oldest`: the earliest possible rollback.
std::string describe_log(const StoredModel& stored, int oldest);

/// The same for programs.
nlohmann::ordered_json log_json(const StoredModel& stored, int oldest);

/// How two models and their predictions on `windows` observed paths differ, for people.
std::string describe(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                     std::size_t windows);

/// The same for programs.
nlohmann::ordered_json to_json(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                               std::size_t windows);

}  // namespace sila
