#include <algorithm>
#include <set>
#include <utility>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "train/steps.hpp"

namespace sila {

ModelChange change_by(const FusionPlan& plan, const Model& previous, const Model& updated) {
  ModelChange change;
  change.primitives_before = static_cast<int>(previous.primitives.size());
  change.primitives_after = static_cast<int>(updated.primitives.size());
  if (plan.kept.size() != updated.primitives.size() || plan.in.size() < previous.primitives.size())
    throw invalid_argument("change_by: plan keeps ", plan.kept.size(), " of ", plan.in.size(),
                           " primitives, the updated model has ", updated.primitives.size());
  const std::vector<int> new_index = inverse_of(plan.kept, plan.in.size());
  const auto at = [&](int joint) { return new_index.at(static_cast<std::size_t>(joint)); };
  const int known = change.primitives_before;
  for (int i = 0; i < known; ++i) {
    if (at(i) < 0) change.gone.push_back(i);
  }
  for (const std::vector<int>& tuple : plan.fusion_set) {
    FusedPrimitive fused{at(tuple.front()), {}, 0};
    for (const int member : tuple) {
      if (member < known)
        fused.previous.push_back(member);
      else
        ++fused.incoming;
    }
    change.fused.push_back(std::move(fused));
  }
  for (const PrimitiveSplit& split : plan.splits) {
    if (split.primitive < known)
      change.split.push_back({split.primitive, at(split.first), at(split.second)});
    else
      ++change.incoming_split;
  }
  for (int k = known - static_cast<int>(change.gone.size()); k < change.primitives_after; ++k)
    change.added.push_back(k);
  return change;
}

ModelChange change_by_retraining(const Model& previous, const Model& updated) {
  const std::size_t before = previous.primitives.size(), after = updated.primitives.size();
  return {static_cast<int>(before), static_cast<int>(after), indices<int>(before), indices<int>(after), {}, {}};
}

ModelChange without_dropped(ModelChange change, const std::vector<int>& kept) {
  const std::vector<int> new_index = inverse_of(kept, static_cast<std::size_t>(change.primitives_after));
  const auto at = [&](int updated) { return new_index.at(static_cast<std::size_t>(updated)); };
  const std::set<int> gone_before(change.gone.begin(), change.gone.end());
  for (int i = 0, updated = 0; i < change.primitives_before; ++i) {
    if (!gone_before.contains(i) && at(updated++) < 0) change.gone.push_back(i);
  }
  std::sort(change.gone.begin(), change.gone.end());
  std::erase_if(change.added, [&](int k) { return at(k) < 0; });
  for (int& k : change.added) k = at(k);
  std::erase_if(change.fused, [&](const FusedPrimitive& fused) { return at(fused.primitive) < 0; });
  for (FusedPrimitive& fused : change.fused) fused.primitive = at(fused.primitive);
  std::erase_if(change.split, [&](const PrimitiveSplit& split) { return at(split.first) < 0 || at(split.second) < 0; });
  for (PrimitiveSplit& split : change.split) {
    split.first = at(split.first);
    split.second = at(split.second);
  }
  change.primitives_after = static_cast<int>(kept.size());
  return change;
}

}  // namespace sila
