#include "sila/refine/prune.hpp"

#include <algorithm>
#include <utility>

#include "core/indices.hpp"
#include "fuse/fuse_fields.hpp"
#include "gp/fuse_gps.hpp"
#include "overlap.hpp"
#include "refine/refine.hpp"

namespace sila {
namespace {

/// The model while it is pruned: transitions keep their indices, and removed ones are not `kept`.
struct PruningState {
  Model& model;
  detail::OverlapIndex index;
  std::vector<bool> kept;
  std::vector<bool> changed;  ///< in this round: the next round compares only pairs with a changed transition
};

/// The transition that subsumes `rare` with the least difference; none if none does. Its count is at least that of
/// `rare`, with `more_often` greater.
std::optional<std::size_t> best_subsumer(PruningState& state, std::size_t rare, const std::vector<bool>& compared,
                                         double agreement, bool more_often) {
  const Transition& own = state.model.transitions[rare];
  const bool apart = state.model.sharing == SiteSharing::apart;  // it is subsumed by none of another site
  std::optional<std::size_t> best;
  double least = 0.0;
  std::vector<bool> eligible = compared[rare] ? state.kept : compared;
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

void subsume(PruningState& state, std::size_t rare, std::size_t into, const FuseConfig& fusing,
             const ResidualConfig& residual) {
  Transition& target = state.model.transitions[into];
  const Transition& source = state.model.transitions[rare];
  const FieldSource both[] = {{&target}, {&source}};
  std::vector<SiteCount> sites = target.sites;
  for (const SiteCount& part : source.sites) add_count(sites, part);
  Transition fused{target.from,
                   target.to,
                   target.count + source.count,
                   fuse_fields(both, fusing.gp),
                   std::move(sites),
                   std::max(target.support, source.support)};
  target = std::move(fused);
  if (std::vector<SparseGp>& residuals = state.model.refinement.residuals; !residuals.empty()) {
    const GpSource sources[] = {{&residuals[into]}, {&residuals[rare]}};
    residuals[into] = fuse_sources(sources, residual_gp_config(residual));
  }
  state.kept[rare] = false;
  state.index.remove(rare);
  state.index.replace(into);
  state.changed[into] = true;
}

/// Merges rare transitions into those that agree best, until no pair agrees: a transition that grew may agree with
/// further ones. Returns the number of merged transitions.
int subsume_rare(PruningState& state, double max_count, const FuseConfig& fusing, const ResidualConfig& residual) {
  const double agreement = PruneConfig::agreement_mps / state.model.settings.reference_width_m;
  std::vector<std::size_t> order = indices(state.model.transitions.size());
  int subsumed = 0;
  std::vector<bool> compared(order.size(), true);
  for (; std::find(compared.begin(), compared.end(), true) != compared.end();
       compared = std::exchange(state.changed, std::vector<bool>(order.size(), false))) {
    std::ranges::stable_sort(order, {},
                             [&](std::size_t i) { return state.model.transitions[i].count; });  // the rarest first
    for (const std::size_t rare : order) {
      if (!state.kept[rare] || state.model.transitions[rare].count > max_count) continue;
      const auto subsumer = best_subsumer(state, rare, compared, agreement, false);
      if (!subsumer) continue;
      subsume(state, rare, *subsumer, fusing, residual);
      ++subsumed;
    }
  }
  return subsumed;
}

/// Merges each transition without recent observations into the more frequent one that knows its place and differs
/// least; returns how many.
int subsume_old(PruningState& state, const PruneConfig& config, const FuseConfig& fusing,
                const ResidualConfig& residual) {
  int subsumed = 0;
  constexpr double any_difference = std::numeric_limits<double>::infinity();
  const std::vector<bool> all(state.model.transitions.size(), true);
  for (std::size_t i = 0; i < state.model.transitions.size(); ++i) {
    const Transition& old = state.model.transitions[i];
    if (!state.kept[i] || old.count > config.expire_count) continue;
    if (age_episodes(old.sites, state.model.sites) < config.expire_after_episodes) continue;
    const auto subsumer = best_subsumer(state, i, all, any_difference, true);
    if (!subsumer) continue;
    subsume(state, i, *subsumer, fusing, residual);
    ++subsumed;
  }
  return subsumed;
}

}  // namespace

PruneResult prune(Model model, const PruneConfig& config, const FuseConfig& fusing, const ResidualConfig& residual) {
  const std::size_t primitives = model.primitives.size(), transitions = model.transitions.size();
  if (!config.enabled) return {std::move(model), {}, indices<int>(primitives)};
  PruningState state{model, detail::OverlapIndex(model.transitions), std::vector<bool>(transitions, true),
                     std::vector<bool>(transitions, false)};
  PruneReport report;
  report.subsumed = subsume_rare(state, config.max_count, fusing, residual);
  report.subsumed += subsume_old(state, config, fusing, residual);
  std::vector<int> kept = detail::remove_transitions(model, state.kept);
  report.primitives = static_cast<int>(primitives - model.primitives.size());
  return {std::move(model), report, std::move(kept)};
}

}  // namespace sila
