#pragma once

#include <concepts>
#include <limits>
#include <type_traits>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/prune.hpp"

namespace sila {

/// Maximum size of a model; infinite: none.
struct ModelBudget {
  double max_primitives = std::numeric_limits<double>::infinity();
  double max_bytes = std::numeric_limits<double>::infinity();
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ModelBudget>
void fields(Config& config, Visitor&& visit) {
  const double none = std::numeric_limits<double>::infinity();
  visit.number("max_primitives", config.max_primitives, Range{1.0, none}, "primitives",
               "maximum; the transitions of least worth are evicted");
  visit.number("max_bytes", config.max_bytes, Range{1.0, none}, "bytes",
               "maximum of the model, without the file's log of episodes; the transitions of least worth are evicted");
}

/// What was evicted or reduced.
struct BudgetReport {
  int primitives = 0;
  int transitions = 0;
  double count = 0.0;  ///< of those transitions [trajectories]
  int reduced = 0;     ///< residual GPs with fewer pseudo-inputs than before; reduced twice counts twice
};

struct BudgetResult {
  Model model;
  BudgetReport report;
  std::vector<int> kept;  ///< the primitives that stay, by their old index
};

/// Evicts the transitions of least worth until the model is within its budget; if bytes are short, reduces the
/// pseudo-inputs of residual GPs before that. Worth: the transition's count times the share of its field, at least a
/// quarter because its residual GP goes as well, that no other field knows and agrees with (criteria of `prune`). If
/// bytes are short, worth per byte; if primitives are short, the worth of all transitions that touch one.
/// Throws: std::invalid_argument for a field out of range, or if not even one transition fits.
/// Source: none in the paper; docs/decisions/0048-limits.md.
BudgetResult apply_budget(Model model, const ModelBudget& budget, const PruneConfig& overlap = {});

}  // namespace sila
