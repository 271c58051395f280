#pragma once

#include <Eigen/Core>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

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
