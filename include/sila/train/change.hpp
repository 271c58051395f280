#pragma once

#include <vector>

#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// A primitive of the updated model that was made from others.
struct FusedPrimitive {
  int primitive = 0;          ///< index in the updated model
  std::vector<int> previous;  ///< of the previous model, sorted
  int incoming = 0;           ///< how many of the increment
};

/// A previous primitive that was replaced by two of the updated model, one after the other.
struct ReplacedPrimitive {
  int previous = 0;  ///< index in the previous model
  int first = 0;     ///< indices in the updated model
  int second = 0;
};

/// What one episode did to the primitives: the history of a model from its first episode on.
/// Invariant: the previous primitives that are not in `gone` keep their order, those of the increment follow.
struct ModelChange {
  int primitives_before = 0;
  int primitives_after = 0;
  std::vector<int> gone;   ///< previous primitives that are no more: fused into another one, or split
  std::vector<int> added;  ///< updated primitives that come from the increment alone
  std::vector<FusedPrimitive> fused;
  std::vector<ReplacedPrimitive> split;
  int incoming_split = 0;  ///< primitives of the increment that were replaced by two
};

/// Throws: std::invalid_argument if the plan is not about these models.
ModelChange change_by(const FusionPlan& plan, const Model& previous, const Model& updated);

/// For a model that was learnt anew: all that was is gone, all that is was added.
ModelChange change_by_retraining(const Model& previous, const Model& updated);

/// The change if of the updated primitives only those in `kept` (sorted indices) stay.
ModelChange without_dropped(ModelChange change, const std::vector<int>& kept);

}  // namespace sila
