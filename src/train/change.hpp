#pragma once

#include <vector>

#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// The changes by a fusion with this plan. Throws: std::invalid_argument if the plan is not that of these models.
ModelChange change_by(const FusionPlan& plan, const Model& previous, const Model& updated);

/// The changes if a model was learnt again from all data: all previous primitives are gone, all updated ones added.
ModelChange change_by_retraining(const Model& previous, const Model& updated);

/// The change after later steps (pruning, budget) that keep only the updated primitives in `kept` (sorted indices).
ModelChange without_dropped(ModelChange change, const std::vector<int>& kept);

}  // namespace sila
