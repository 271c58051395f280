#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "sila/io/model_file.hpp"
#include "sila/train/episode.hpp"

namespace sila {

nlohmann::ordered_json to_json(const BudgetReport& report);

/// The change as a model file keeps it: the shapes of the primitives that are new or fused, and the transitions whose
/// count is another one. Its length depends on what changed, not on the size of the model.
/// Shapes: `cells` is x, y and direction [whole degrees] of each cell, one after the other.
nlohmann::ordered_json to_json(const ModelChange& change, const Model& previous, const Model& updated);

/// The record in the model file of an episode that began with `previous`; numbers count from 1. Its time is now.
EpisodeRecord record_of(int number, const Model& previous, const Episode& episode);

/// The episodes of both, renumbered in this order: those of a model that was fused from two.
std::vector<EpisodeRecord> joined(std::vector<EpisodeRecord> first, const std::vector<EpisodeRecord>& second);

}  // namespace sila
