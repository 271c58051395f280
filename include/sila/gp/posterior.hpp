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
struct PosteriorView;
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

/// Where a point of a raster is: at which of the raster's x and of its y.
struct RasterPlace {
  std::size_t column = 0, row = 0;
};

/// A SparseGp made ready for many predictions: mean(x) = mean + weights' k, variance(x) = signal_variance - |reduction
/// k|^2 with k = k(Z, x); so the variance is never above the prior's. Immutable; may be used from many threads; copies
/// share the tables. Source: algorithms 2.4. Differs: reduction' reduction = K_uu^-1 - L_u^-T B^-1 L_u^-1 is kept as a
/// lower triangle (docs/decisions/0012).
class Posterior {
 public:
  /// Predictions do not allocate up to this many pseudo-inputs.
  static constexpr std::size_t max_stack_pseudo_inputs = 256;

  /// Throws: std::invalid_argument if gp is not valid; NumericalError.
  explicit Posterior(const SparseGp& gp);

  /// Shapes: x is D. Throws: std::invalid_argument for a wrong shape or NaN.
  GpPrediction predict(const Eigen::VectorXd& x) const;
  /// The same without allocating: the mean is written, the variance returned. Shapes: x is D, mean is P. Throws: as
  /// `predict`.
  double predict(std::span<const double> x, std::span<double> mean) const;
  /// At most so large a share of the signal variance is explained at x; found with less work than the variance, from
  /// |reduction k| <= sum over m of |column m of reduction| k_m. Throws: as `predict`.
  double most_explained(std::span<const double> x) const;
  /// The same as `predict`, but nothing where surely less than `share` of the signal variance is explained.
  std::optional<double> predict_where_known(std::span<const double> x, std::span<double> mean, double share) const;

  /// For D = 2, P = 2. Throws: std::invalid_argument if the GP is of another shape.
  FlowPrediction predict_flow(const Eigen::Vector2d& x) const;
  /// The mean with the least variance that there may be, at places of a raster: exponentials are found once for each of
  /// its columns and rows from the first to the last of the places. Shapes: as many scores as places. Throws: as
  /// `predict_flow`, if a place is beyond the raster, or for numbers of scores and places that differ.
  void score_flow(std::span<const double> xs, std::span<const double> ys, std::span<const RasterPlace> places,
                  std::span<FlowPrediction> summaries) const;
  Eigen::Vector2d flow_mean(const Eigen::Vector2d& x) const;
  Eigen::Matrix2d mean_jacobian(const Eigen::Vector2d& x) const;
  FlowLinearisation linearise_flow(const Eigen::Vector2d& x) const;

  double signal_variance() const { return signal_variance_; }
  double noise_variance() const { return noise_variance_; }
  std::size_t inputs() const { return inputs_; }
  std::size_t outputs() const { return outputs_; }

 private:
  /// What one vector register holds at most. Rows of tables begin with a line, so that no register is read from two.
  struct alignas(64) Line {
    double numbers[8];
  };

  detail::PosteriorView view() const;
  void require_input(std::span<const double> x) const;
  void require_output(std::span<double> mean) const;
  void require_flow(const Eigen::Vector2d& x) const;

  double signal_variance_ = 1.0;
  double noise_variance_ = 1.0;
  std::size_t inputs_ = 0, outputs_ = 0;
  std::size_t columns_ = 0;                          ///< padded number of pseudo-inputs
  std::shared_ptr<const std::vector<Line>> tables_;  ///< one after another as in the view
};

}  // namespace sila
