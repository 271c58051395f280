#pragma once

#include <Eigen/Core>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

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

namespace detail {

/// A posterior with 2 inputs and 2 outputs, laid out for vector registers: rows padded with zeros.
struct FlowTables {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Vector2d inverse_length_scales = Eigen::Vector2d::Ones();
  double signal_variance = 1.0;
  Eigen::ArrayX2d inputs;
  Eigen::ArrayX2d weights;
  Eigen::MatrixXd reduction;
};

}  // namespace detail

/// A SparseGp made ready for many predictions: mean(x) = mean + weights' k, variance(x) = signal_variance - |reduction
/// k|^2 with k = k(Z, x); so the variance is never above the prior's. Immutable; may be used from many threads. Source:
/// algorithms 2.4. Differs: reduction' reduction = K_uu^-1 - L_u^-T B^-1 L_u^-1 is kept as a factor
/// (docs/decisions/0012).
class Posterior {
 public:
  /// The flow functions work on the stack up to this many pseudo-inputs.
  static constexpr Eigen::Index max_stack_pseudo_inputs = 64;

  /// Throws: std::invalid_argument if gp is not valid; NumericalError.
  explicit Posterior(const SparseGp& gp);

  /// Shapes: x is D. Throws: std::invalid_argument for a wrong shape or NaN.
  GpPrediction predict(const Eigen::VectorXd& x) const;

  /// For D = 2, P = 2; these do not allocate. Throws: std::invalid_argument if the GP is of another shape.
  FlowPrediction predict_flow(const Eigen::Vector2d& x) const;
  Eigen::Matrix2d mean_jacobian(const Eigen::Vector2d& x) const;
  FlowLinearisation linearise_flow(const Eigen::Vector2d& x) const;

  double signal_variance() const { return kernel_.signal_variance; }
  double noise_variance() const { return noise_variance_; }

 private:
  void require_flow(const Eigen::Vector2d& x) const;

  Kernel kernel_;
  double noise_variance_ = 1.0;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd pseudo_inputs_;  // D x M
  Eigen::MatrixXd weights_;        // M x P
  Eigen::MatrixXd reduction_;      // rank x M
  bool is_flow_ = false;
  detail::FlowTables flow_;
};

}  // namespace sila
