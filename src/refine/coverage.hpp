#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "sila/gp/flow_posterior.hpp"
#include "sila/model/model.hpp"

namespace sila::detail {

/// When a field speaks for another one at a place. Fields of two GPs are compared at the pseudo-inputs of the first.
struct Coverage {
  double known_ratio = 0.4;  ///< it knows the place: variance / signal variance is below this
  double agreement = 0.3;    ///< velocities that differ by less are alike [widths/s]
  double share = 0.8;        ///< of the pseudo-inputs of the other field, which it must know
};

/// The fields of a model by where they are, factorised when they are first asked. Indices are those of the transitions
/// at the beginning; a transition that is gone is never found.
class FieldIndex {
 public:
  FieldIndex(const std::vector<Transition>& transitions, double bucket_size);

  /// Of the `wanted` transitions those whose boxes, one length scale wider, hold at least `share` of the pseudo-inputs
  /// of `of`; sorted.
  std::vector<int> candidates(const Transition& of, double share, const std::vector<bool>& wanted) const;
  const FlowPosterior& posterior(int transition, const Transition& content);
  /// What it says itself at its pseudo-inputs.
  const Eigen::Matrix2Xd& own_means(int transition, const Transition& content);
  /// Root mean square difference of `by` and `of` at the pseudo-inputs of `of` that `by` knows, if `by` speaks for `of`
  /// [widths/s].
  std::optional<double> difference(int of, const Transition& asked, int by, const Transition& speaker,
                                   const Coverage& coverage);
  void remove(int transition);
  /// The transition has another field now.
  void replace(int transition, const Transition& content);

 private:
  void insert(int transition, const Transition& content);

  double bucket_size_ = 1.0;
  std::vector<std::optional<FlowPosterior>> posteriors_;
  std::vector<std::optional<Eigen::Matrix2Xd>> means_;
  std::vector<Eigen::AlignedBox2d> boxes_;  ///< empty: gone
  std::unordered_map<std::int64_t, std::vector<int>> buckets_;
  std::vector<int> wide_;  ///< in no bucket: they would be in too many
};

/// Removes transitions (`kept[i]` false) and the primitives that no transition touches.
/// Returns the primitives that stay, by their old index.
std::vector<int> thin_out(Model& model, const std::vector<bool>& kept);

}  // namespace sila::detail
