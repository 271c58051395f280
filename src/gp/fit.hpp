#pragma once

#include <Eigen/Core>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// A sparse GP of the data about config.constant_mean; the outputs share theta and Z. With fewer points than
/// config.min_points_to_optimise, Z is chosen greedily and theta kept.
/// Shapes: 0 points: mean zero; then, and for one point about its own mean: no pseudo-inputs, the prior's variance.
/// Throws: std::invalid_argument for wrong shapes, NaN or a field out of range; NumericalError.
/// Source: docs/gp.md, section 6.
SparseGp fit_sparse_gp(const GpData& data, const Hyperparameters& start, const GpConfig& config = {});

/// The negative log marginal likelihood and its derivatives.
struct MarginalLikelihoodGradient {
  double value = 0.0;
  Eigen::MatrixXd pseudo_inputs;      ///< D x M
  Eigen::VectorXd log_length_scales;  ///< D
  double log_signal_variance = 0.0;
  double log_noise_variance = 0.0;
};

/// Negative log marginal likelihood of FITC, summed over the outputs, whose mean is taken as zero, and its gradient by
/// adjoints. Shapes: data as GpData, pseudo_inputs D x M. Throws: std::invalid_argument for wrong shapes or NaN;
/// NumericalError. Source: docs/gp.md, section 4. Cost O(n M^2).
MarginalLikelihoodGradient negative_log_marginal_likelihood_gradient(const GpData& data,
                                                                     const Hyperparameters& hyperparameters,
                                                                     const Eigen::MatrixXd& pseudo_inputs,
                                                                     double jitter = default_jitter);

}  // namespace sila
