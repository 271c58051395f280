#include "sila/refine/prune.hpp"

#include <algorithm>
#include <utility>

#include "core/indices.hpp"
#include "fuse/steps.hpp"
#include "gp/fuse_gps.hpp"
#include "refine/overlap.hpp"
#include "refine/residual.hpp"

namespace sila {
namespace {

/// The model while it is pruned: transitions keep their indices, and removed ones are not `kept`.
struct PruningState {
  Model& model;
  const FuseConfig& fusing;
  const ResidualConfig& residual;
  OverlapIndex index{model.transitions};
  std::vector<bool> kept = std::vector<bool>(model.transitions.size(), true);
  /// This round compares only pairs with one of these: those that the last round changed, in the first round all.
  std::vector<bool> compared = kept;
  std::vector<bool> changed = std::vector<bool>(kept.size(), false);  ///< in this round
};

/// The transition that subsumes `rare` with the least difference; none if none does. Its count is at least that of
/// `rare`, with `more_often` greater.
std::optional<std::size_t> best_subsumer(PruningState& state, std::size_t rare, double agreement, bool more_often) {
  const Transition& own = state.model.transitions[rare];
  const bool apart = state.model.sharing == SiteSharing::apart;  // it is subsumed by none of another site
  std::optional<std::size_t> best;
  double least = 0.0;
  std::vector<bool> eligible = state.compared[rare] ? state.kept : state.compared;
  eligible[rare] = false;
  for (const std::size_t i : state.index.candidates(rare, PruneConfig::agreement_share, eligible)) {
    const Transition& other = state.model.transitions[i];
    if (other.count < own.count || (more_often && other.count == own.count)) continue;
    if (apart && !share_a_site(other.sites, own.sites)) continue;
    const auto difference = state.index.difference(rare, i, agreement);
    if (!difference || (best && *difference >= least)) continue;
    best = i;
    least = *difference;
  }
  return best;
}

/// Merges a transition into its best subsumer; returns whether there is one.
bool subsume(PruningState& state, std::size_t rare, double agreement, bool more_often) {
  const auto into = best_subsumer(state, rare, agreement, more_often);
  if (!into) return false;
  Transition& target = state.model.transitions[*into];
  const Transition& source = state.model.transitions[rare];
  const FieldSource both[] = {{&target}, {&source}};
  target.field = fuse_fields(both, state.fusing.gp);
  target.count += source.count;
  for (const SiteCount& part : source.sites) add_count(target.sites, part);
  target.support = std::max(target.support, source.support);
  if (std::vector<SparseGp>& residuals = state.model.refinement.residuals; !residuals.empty()) {
    const GpSource sources[] = {{&residuals[*into]}, {&residuals[rare]}};
    residuals[*into] = fuse_sources(sources, residual_gp_config(state.residual));
  }
  state.kept[rare] = state.compared[rare] = state.changed[rare] = false;
  state.index.replace(*into);
  state.changed[*into] = true;
  return true;
}

/// Merges rare transitions into those that agree best, until no pair agrees: a transition that grew may agree with
/// further ones. Returns the number of merged transitions.
int subsume_rare(PruningState& state) {
  const double agreement = PruneConfig::agreement_mps / state.model.settings.reference_width_m;
  std::vector<std::size_t> order = indices(state.model.transitions.size());
  int subsumed = 0;
  for (; std::ranges::count(state.compared, true) > 0;
       state.compared = std::exchange(state.changed, std::vector<bool>(order.size(), false))) {
    std::ranges::stable_sort(order, {},
                             [&](std::size_t i) { return state.model.transitions[i].count; });  // the rarest first
    for (const std::size_t rare : order) {
      const bool eligible = state.kept[rare] && state.model.transitions[rare].count <= PruneConfig::max_count;
      if (eligible && subsume(state, rare, agreement, false)) ++subsumed;
    }
  }
  return subsumed;
}

/// Merges each transition without recent observations into the more frequent one that knows its positions and
/// differs least; returns how many.
int subsume_old(PruningState& state) {
  int subsumed = 0;
  constexpr double any_difference = std::numeric_limits<double>::infinity();
  state.compared = state.kept;
  for (std::size_t i = 0; i < state.model.transitions.size(); ++i) {
    const Transition& old = state.model.transitions[i];
    if (!state.kept[i] || old.count > PruneConfig::expire_count) continue;
    if (age_episodes(old.sites, state.model.sites) < PruneConfig::expire_after_episodes) continue;
    if (subsume(state, i, any_difference, true)) ++subsumed;
  }
  return subsumed;
}

}  // namespace

PruneResult prune(Model model, const PruneConfig& config, const FuseConfig& fusing, const ResidualConfig& residual) {
  const std::size_t primitives = model.primitives.size();
  if (!config.enabled) return {std::move(model), {}, indices<int>(primitives)};
  PruningState state{model, fusing, residual};
  PruneReport report;
  report.subsumed = subsume_rare(state);
  report.subsumed += subsume_old(state);
  std::vector<int> kept = remove_transitions(model, state.kept);
  report.primitives = static_cast<int>(primitives - model.primitives.size());
  return {std::move(model), report, std::move(kept)};
}

}  // namespace sila
