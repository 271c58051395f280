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

/// Velocity at one point, and the variance of f for each of its two components.
struct FieldPrediction {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance = Eigen::Vector2d::Zero();
};

/// A field prediction with d mean / d x: column d is the change with input d.
struct FieldLinearisation {
  FieldPrediction flow;
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

  /// Writes the mean and returns the variance of f, common to the outputs; empty where an upper bound of the explained
  /// share of the signal variance is below `least_share`, so never by default. The bound, |T k| <= sum over m of
  /// |column m of T| k_m, costs less than the variance. Shapes: x is D, mean is P. Throws: std::invalid_argument for a
  /// wrong shape or NaN.
  std::optional<double> predict(std::span<const double> x, std::span<double> mean, double least_share = 0.0) const;

  /// For D = 2, P = 2: both components of the velocity have the same variance. Throws: std::invalid_argument if the GP
  /// is of another shape.
  FieldPrediction predict_flow(const Eigen::Vector2d& x) const;
  FieldLinearisation linearise_flow(const Eigen::Vector2d& x) const;
  /// The mean and a lower bound of the variance at points of a raster. k is a product over the inputs, so exponentials
  /// are found once for each column and row between the first and the last of the points. Throws: as `predict_flow`, or
  /// if a point is outside the raster.
  std::vector<FieldPrediction> bound_flows(std::span<const double> xs, std::span<const double> ys,
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
