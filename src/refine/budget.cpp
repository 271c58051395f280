#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "gp/fuse_gps.hpp"
#include "refine/overlap.hpp"
#include "sila/model/packing.hpp"
#include "sila/refine/prune.hpp"

namespace sila {
namespace {

/// Least unique share of a transition: even if others represent its whole field, its residual GP is lost with it.
constexpr double kMinUniqueShare = 0.25;
/// To save bytes, residual GPs are reduced to the first of these numbers of pseudo-inputs, then to the next, before a
/// transition is evicted.
constexpr std::array kReducedPseudoInputs{60, 30};

/// For each transition:
struct SubsumptionTable {
  std::vector<std::vector<int>> subsumers;  ///< of each of its pseudo-inputs: number of others that know it and agree
  /// Pseudo-inputs of others that it knows and agrees with: transition and pseudo-input.
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> subsumes;
  std::vector<bool> kept;
  std::vector<double> bytes;  ///< with its residual GP
};

/// Adds the pseudo-inputs of `of` that `by` knows and agrees with.
void add_overlap(SubsumptionTable& table, OverlapIndex& index, const std::vector<Transition>& transitions,
                 std::size_t of, std::size_t by, double agreement) {
  const Eigen::Matrix2Xd& own = index.own_means(of);
  const FlowPosterior& other = index.posterior(by);
  const Eigen::MatrixXd& positions = transitions[of].field.gp.pseudo_inputs;
  for (Eigen::Index m = 0; m < positions.cols(); ++m) {
    const FieldPrediction predicted = other.predict(positions.col(m));
    if (!knows(other, predicted) || (predicted.mean - own.col(m)).norm() >= agreement) continue;
    ++table.subsumers[of][static_cast<std::size_t>(m)];
    table.subsumes[by].emplace_back(of, static_cast<std::size_t>(m));
  }
}

SubsumptionTable subsumption_table(const Model& model) {
  const std::vector<Transition>& transitions = model.transitions;
  const bool apart = model.sharing == SiteSharing::apart;
  SubsumptionTable table;
  table.subsumes.resize(transitions.size());
  table.kept.assign(transitions.size(), true);
  for (std::size_t i = 0; i < transitions.size(); ++i) {
    table.subsumers.emplace_back(static_cast<std::size_t>(transitions[i].field.gp.pseudo_inputs.cols()), 0);
    table.bytes.push_back(static_cast<double>(packed_bytes(transitions[i], entry_of(model.refinement.residuals, i))));
  }
  const double agreement = PruneConfig::agreement_mps / model.settings.reference_width_m;
  OverlapIndex index(transitions);
  for (std::size_t of = 0; of < transitions.size(); ++of) {
    for (const std::size_t other : index.candidates(of, 0.0, table.kept)) {
      if (other == of || (apart && !share_a_site(transitions[of].sites, transitions[other].sites))) continue;
      add_overlap(table, index, transitions, of, other, agreement);
    }
  }
  return table;
}

double worth(const SubsumptionTable& table, const std::vector<Transition>& transitions, std::size_t i) {
  const std::vector<int>& subsumers = table.subsumers[i];
  const auto alone = static_cast<double>(std::count(subsumers.begin(), subsumers.end(), 0));
  const double unique_share = subsumers.empty() ? 1.0 : alone / static_cast<double>(subsumers.size());
  return transitions[i].count * std::max(kMinUniqueShare, unique_share);
}

void evict(SubsumptionTable& table, const Transition& transition, std::size_t i, BudgetReport& report) {
  table.kept[i] = false;
  for (const auto& [other, input] : table.subsumes[i]) --table.subsumers[other][input];
  ++report.transitions;
  report.count += transition.count;
}

/// For each primitive that has transitions the sum of their worth.
std::map<int, double> worth_of_primitives(const SubsumptionTable& table, const Model& model) {
  std::map<int, double> sums;
  for (std::size_t i = 0; i < model.transitions.size(); ++i) {
    if (!table.kept[i]) continue;
    const double here = worth(table, model.transitions, i);
    const Transition& transition = model.transitions[i];
    sums[transition.from] += here;
    if (transition.to != transition.from) sums[transition.to] += here;
  }
  return sums;
}

void keep_to_primitives(SubsumptionTable& table, const Model& model, double most, BudgetReport& report) {
  for (auto sums = worth_of_primitives(table, model); static_cast<double>(sums.size()) > most;
       sums = worth_of_primitives(table, model)) {
    const int least = std::ranges::min_element(sums, {}, [](const auto& entry) { return entry.second; })->first;
    for (std::size_t i = 0; i < model.transitions.size(); ++i) {
      const Transition& transition = model.transitions[i];
      if (table.kept[i] && (transition.from == least || transition.to == least)) evict(table, transition, i, report);
    }
  }
}

/// Bytes of the primitives that have transitions.
double bytes_of_primitives(const SubsumptionTable& table, const Model& model) {
  double bytes = 0.0;
  for (const auto& [primitive, sum] : worth_of_primitives(table, model))
    bytes += static_cast<double>(packed_bytes(model.primitives[static_cast<std::size_t>(primitive)]));
  return bytes;
}

/// Reduces residual GPs, those of the rarest transitions first, until `excess` bytes are saved.
void reduce_residuals(SubsumptionTable& table, Model& model, double excess, BudgetReport& report) {
  std::vector<SparseGp>& residuals = model.refinement.residuals;
  std::vector<std::size_t> order = indices(residuals.size());
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return model.transitions[i].count; });
  for (const int most : kReducedPseudoInputs) {
    for (const std::size_t i : order) {
      if (excess <= 0.0) return;
      if (!table.kept[i] || residuals[i].pseudo_inputs.cols() <= most) continue;
      residuals[i] = reduce_pseudo_inputs(residuals[i], most);
      const auto bytes = static_cast<double>(packed_bytes(model.transitions[i], residuals[i]));
      excess -= std::exchange(table.bytes[i], bytes) - bytes;
      ++report.reduced;
    }
  }
}

double bytes_of_transitions(const SubsumptionTable& table) {
  double bytes = 0.0;
  for (std::size_t i = 0; i < table.kept.size(); ++i) bytes += table.kept[i] ? table.bytes[i] : 0.0;
  return bytes;
}

void keep_to_bytes(SubsumptionTable& table, Model& model, double most, BudgetReport& report) {
  reduce_residuals(table, model, bytes_of_transitions(table) + bytes_of_primitives(table, model) - most, report);
  const std::vector<std::size_t> all = indices(model.transitions.size());
  const auto worth_per_byte = [&](std::size_t i) {
    return table.kept[i] ? worth(table, model.transitions, i) / table.bytes[i] : HUGE_VAL;
  };
  double transitions = bytes_of_transitions(table);  // whole numbers: 0 once none is left
  while (transitions > 0.0 && transitions + bytes_of_primitives(table, model) > most) {
    const std::size_t least = *std::ranges::min_element(all, {}, worth_per_byte);
    transitions -= table.bytes[least];
    evict(table, model.transitions[least], least, report);
  }
}

/// `empty`: the model without any transition.
[[noreturn]] void reject(const ModelBudget& budget, const Model& empty) {
  const auto text = [](double value) { return std::isinf(value) ? "inf" : std::to_string(std::llround(value)); };
  throw invalid_argument("apply_budget: budget.max_primitives = ", text(budget.max_primitives),
                         " and budget.max_bytes = ", text(budget.max_bytes),
                         " leave no room for a single transition; without any the model has ", packed_bytes(empty),
                         " bytes");
}

}  // namespace

BudgetResult apply_budget(Model model, const ModelBudget& budget) {
  validate_fields("apply_budget", budget);
  const std::size_t before = model.primitives.size();
  const bool few = static_cast<double>(before) <= budget.max_primitives;
  if (few && (std::isinf(budget.max_bytes) || static_cast<double>(packed_bytes(model)) <= budget.max_bytes))
    return {std::move(model), {}, indices<int>(before)};
  BudgetReport report;
  SubsumptionTable table = subsumption_table(model);
  keep_to_primitives(table, model, budget.max_primitives, report);
  if (!std::isinf(budget.max_bytes)) {
    Model rest = model;
    rest.primitives.clear();
    rest.transitions.clear();
    keep_to_bytes(table, model, budget.max_bytes - static_cast<double>(packed_bytes(rest)), report);
  }
  std::vector<int> kept = remove_transitions(model, table.kept);
  if (model.transitions.empty()) reject(budget, model);
  report.primitives = static_cast<int>(before - model.primitives.size());
  return {std::move(model), report, std::move(kept)};
}

}  // namespace sila
