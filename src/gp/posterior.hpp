#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sila/gp/sparse_gp.hpp"

namespace sila {
namespace detail {
struct PosteriorTables;
}

/// Mean and variance of a flow (2 inputs, 2 outputs) at one point; the variance is of f, common to both outputs.
struct FlowPrediction {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double variance = 0.0;
};

/// A flow prediction with d mean / d x: column d is the change with input d.
struct FlowLinearisation {
  FlowPrediction flow;
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();
};

/// A point of a raster, by the index of its x and of its y.
struct RasterIndex {
  std::size_t column = 0, row = 0;
};

/// A SparseGp prepared for many predictions: mean(x) = mean + weights' k, variance(x) = signal_variance - |T k|^2 with
/// k = k(Z, x); so the variance is never above the prior's. Immutable; may be used from many threads; copies are cheap.
/// Source: docs/gp.md, section 3. Differs: T'T = K_uu^-1 - L_u^-T B^-1 L_u^-1 is stored as a lower triangle T
/// (docs/decisions/0012).
class Posterior {
 public:
  /// Predictions do not allocate up to this number of pseudo-inputs.
  static constexpr std::size_t max_stack_pseudo_inputs = 256;

  /// Throws: std::invalid_argument if gp is not valid; NumericalError.
  explicit Posterior(const SparseGp& gp);

  /// Shapes: x is D. Throws: std::invalid_argument for a wrong shape or NaN.
  GpPrediction predict(const Eigen::VectorXd& x) const;
  /// The same without allocation: the mean is written, the variance returned. Shapes: x is D, mean is P. Throws: as
  /// `predict`.
  double predict(std::span<const double> x, std::span<double> mean) const;
  /// As `predict`, but empty where an upper bound of the explained share of the signal variance is below `share`. The
  /// bound, |T k| <= sum over m of |column m of T| k_m, costs less than the variance.
  std::optional<double> predict_if_explained(std::span<const double> x, std::span<double> mean, double share) const;

  /// For D = 2, P = 2. Throws: std::invalid_argument if the GP is of another shape.
  FlowPrediction predict_flow(const Eigen::Vector2d& x) const;
  FlowLinearisation linearise_flow(const Eigen::Vector2d& x) const;
  /// The mean and a lower bound of the variance at points of a raster. k is a product over the inputs, so exponentials
  /// are found once for each column and row between the first and the last of the points. Throws: as `predict_flow`, or
  /// if a point is outside the raster.
  std::vector<FlowPrediction> bound_flows(std::span<const double> xs, std::span<const double> ys,
                                          std::span<const RasterIndex> points) const;

  double signal_variance() const { return signal_variance_; }
  double noise_variance() const { return noise_variance_; }
  std::size_t inputs() const { return inputs_; }
  std::size_t outputs() const { return outputs_; }

 private:
  double signal_variance_ = 1.0, noise_variance_ = 1.0;
  std::size_t inputs_ = 0, outputs_ = 0;
  std::shared_ptr<const detail::PosteriorTables> tables_;
};

}  // namespace sila
