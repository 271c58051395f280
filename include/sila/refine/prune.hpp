#pragma once

#include <limits>
#include <span>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// Which transitions are merged into others.
/// Source: none in the paper, whose models grow without limit; docs/decisions/0047-pruning.md.
struct PruneConfig {
  bool enabled = true;
  /// A transition seen at most this often is subsumed by one that agrees with it [trajectories].
  static constexpr double max_count = 3.0;
  /// Share of its pseudo-inputs that the other field must know.
  static constexpr double agreement_share = 0.8;
  /// A field knows a position where its variance is below this [of the signal variance].
  static constexpr double known_ratio = 0.4;
  /// Fields whose root mean square difference there is below this agree [m/s].
  static constexpr double agreement_mps = 0.3;
  /// A transition seen at most this often expires where another one knows its place [trajectories].
  static constexpr double expire_count = 3.0;
  /// Episodes at its site without an observation after which a transition may expire.
  static constexpr double expire_after_episodes = 10.0;
};

void fields(MaybeConst<PruneConfig> auto& config, auto&& visit) {
  visit.flag("enabled", config.enabled,
             "remove rare transitions that others represent, after each episode (paper: off)");
}

/// Counts of merged and removed parts.
struct PruneReport {
  int subsumed = 0;    ///< transitions that became part of another one
  int primitives = 0;  ///< removed because no transition touches them any more
};

/// A smaller model.
template <class Report>
struct ReductionResult {
  Model model;
  Report report;
  std::vector<int> kept;  ///< the primitives that stay, by their old index
};
using PruneResult = ReductionResult<PruneReport>;

/// Merges rare transitions into those whose fields agree with them (counts add, fields and residual GPs are fused), and
/// transitions without recent observations into one that knows their place, also if it disagrees. Removes primitives
/// that no transition touches. With sites apart, a transition subsumes only transitions of its own site. Never grows a
/// model; idempotent. With `enabled` false the model itself, bit for bit. Precondition: `check(model)`.
PruneResult prune(Model model, const PruneConfig& config, const FuseConfig& fusing = {},
                  const ResidualConfig& residual = {});

/// Maximum size of a model; infinite: no limit.
struct ModelBudget {
  double max_primitives = std::numeric_limits<double>::infinity();
  double max_bytes = std::numeric_limits<double>::infinity();
};

void fields(MaybeConst<ModelBudget> auto& config, auto&& visit) {
  const double none = std::numeric_limits<double>::infinity();
  visit.number("max_primitives", config.max_primitives, Range{1.0, none}, "primitives",
               "maximum; the transitions of least worth are evicted");
  visit.number("max_bytes", config.max_bytes, Range{1.0, none}, "bytes",
               "maximum of the model, without the file's log of episodes; the transitions of least worth are evicted");
}

/// Counts of evicted and reduced parts.
struct BudgetReport {
  int primitives = 0;
  int transitions = 0;
  double count = 0.0;  ///< of those transitions [trajectories]
  int reduced = 0;     ///< residual GPs with fewer pseudo-inputs than before; reduced twice counts twice
};

using BudgetResult = ReductionResult<BudgetReport>;

/// Evicts the transitions of least worth until the model is within its budget; if bytes are short, reduces the
/// pseudo-inputs of residual GPs before that. Worth: the transition's count times the share of its field, at least a
/// quarter because its residual GP goes as well, that no other field knows and agrees with (criteria of `prune`). If
/// bytes are short, worth per byte; if primitives are short, the worth of all transitions that touch one.
/// Throws: std::invalid_argument for a field out of range, or if not even one transition fits.
/// Source: none in the paper; docs/decisions/0048-limits.md.
BudgetResult apply_budget(Model model, const ModelBudget& budget);

/// A model for export: only transitions that at least `min_people` different tracks support, between primitives with
/// the same support. Nothing else remains except sums over all tracks (error statistics without those of positions;
/// docs/privacy.md). May be empty. Throws: std::invalid_argument if min_people is below 1. Source:
/// docs/decisions/0092-support.md.
Model k_anonymous(Model model, int min_people);

/// A model that knows only how people walked at the places of other models: the sum of their error statistics and of
/// their different priors, without the sums that depend on positions. Learning that begins with it predicts better
/// while a place has few tracks. Throws: std::invalid_argument if no model has error statistics, their shapes differ,
/// or two have learnt one episode. Source: none in the paper; power prior (Ibrahim and Chen 2000);
/// docs/decisions/0127-prior.md.
Model make_prior(std::span<const Model> models);

}  // namespace sila
