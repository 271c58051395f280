#pragma once

#include <vector>

#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// Throws: std::invalid_argument if the plan is not about these models.
ModelChange change_by(const FusionPlan& plan, const Model& previous, const Model& updated);

/// For a model that was learnt anew: all that was is gone, all that is was added.
ModelChange change_by_retraining(const Model& previous, const Model& updated);

/// The change if of the updated primitives only those in `kept` (sorted indices) stay.
ModelChange without_dropped(ModelChange change, const std::vector<int>& kept);

}  // namespace sila
