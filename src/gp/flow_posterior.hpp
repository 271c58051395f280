#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "gp/posterior.hpp"

namespace sila {

/// A velocity field prepared for many predictions: one GP whose two outputs share pseudo-inputs and theta, or one GP
/// for each component of the velocity. Immutable; may be used from many threads. Source: SILA paper (GP_x, GP_y).
class FlowPosterior {
 public:
  /// Shapes: `gp` has 2 outputs, or 1 if `gp_y` is given, which has 1. Throws: std::invalid_argument for other shapes;
  /// as Posterior.
  explicit FlowPosterior(const SparseGp& gp, const SparseGp* gp_y = nullptr);

  const Eigen::Vector2d& signal_variance() const { return signal_variance_; }
  const Eigen::Vector2d& noise_variance() const { return noise_variance_; }

  /// The share of the signal variance that is left unexplained: the larger one of the two components.
  double unexplained_share(const FieldPrediction& flow) const {
    const double first = flow.variance.x() / signal_variance_.x();
    return second_ ? std::max(first, flow.variance.y() / signal_variance_.y()) : first;
  }

  /// None of these allocates up to Posterior::max_stack_pseudo_inputs. Throws: std::invalid_argument for NaN.
  FieldPrediction predict(const Eigen::Vector2d& x) const {
    const FieldPrediction first = first_.predict_flow(x);
    return second_ ? sum(first, second_->predict_flow(x)) : first;
  }
  FieldLinearisation linearise(const Eigen::Vector2d& x) const;
  /// As Posterior::bound_flows.
  std::vector<FieldPrediction> bounds(std::span<const double> xs, std::span<const double> ys,
                                      std::span<const RasterIndex> points) const;

 private:
  /// The prediction of both components by the first GP's and the second one's.
  static FieldPrediction sum(const FieldPrediction& first, const FieldPrediction& second) {
    return {first.mean + second.mean, {first.variance.x(), second.variance.y()}};
  }

  Posterior first_;                  ///< of both components, or of the one along x and a zero
  std::optional<Posterior> second_;  ///< of a zero and the component along y
  Eigen::Vector2d signal_variance_, noise_variance_;
};

}  // namespace sila
