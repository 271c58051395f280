#pragma once

#include <optional>
#include <vector>

#include "gp/flow_posterior.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Whether a field knows a position, by its prediction there: variance / signal variance is below
/// PruneConfig::known_ratio.
bool knows(const FlowPosterior& field, const FieldPrediction& predicted);

/// Finds fields that overlap; posteriors are made when they are first needed.
class OverlapIndex {
 public:
  /// Keeps the list by reference; its length must not change.
  explicit OverlapIndex(const std::vector<Transition>& transitions);

  /// Those of the `wanted` transitions whose boxes, one length scale wider, hold at least `share` of the pseudo-inputs
  /// of `of`; sorted.
  std::vector<std::size_t> candidates(std::size_t of, double share, const std::vector<bool>& wanted) const;
  const FlowPosterior& posterior(std::size_t transition);
  /// The means of a field at its own pseudo-inputs.
  const Eigen::Matrix2Xd& own_means(std::size_t transition);
  /// Root mean square difference of the fields of `by` and `of` at the pseudo-inputs of `of` that `by` knows
  /// [curb units/s], if it is below `agreement` and `by` knows a share of PruneConfig::agreement_share of them.
  std::optional<double> difference(std::size_t of, std::size_t by, double agreement);
  /// To be called when the field of a transition has changed.
  void replace(std::size_t transition);

 private:
  const std::vector<Transition>& transitions_;
  std::vector<std::optional<FlowPosterior>> posteriors_;
  std::vector<std::optional<Eigen::Matrix2Xd>> means_;
  std::vector<Eigen::AlignedBox2d> boxes_;  ///< one length scale wider than the data
};

/// Removes transitions (`kept[i]` false) with their residual GPs and the primitives that no transition touches.
/// Returns the primitives that stay, by their old index.
std::vector<int> remove_transitions(Model& model, const std::vector<bool>& kept);

}  // namespace sila
