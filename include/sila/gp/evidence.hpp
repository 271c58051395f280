#pragma once

#include <Eigen/Core>

#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Derivatives of the negative log evidence.
struct EvidenceGradient {
  double value = 0.0;
  Eigen::MatrixXd pseudo_inputs;      ///< D x M
  Eigen::VectorXd log_length_scales;  ///< D
  double log_signal_variance = 0.0;
  double log_noise_variance = 0.0;
};

/// Negative log marginal likelihood of FITC, summed over the outputs, which are taken as of zero mean.
/// Shapes: data as GpData, pseudo_inputs D x M.
/// Throws: std::invalid_argument for wrong shapes or NaN; NumericalError.
/// Source: algorithms 2.2. Cost O(n M^2).
double negative_log_evidence(const GpData& data, const Hyperparameters& hyperparameters,
                             const Eigen::MatrixXd& pseudo_inputs, double jitter = default_jitter);

/// The same with its gradient by adjoints. Source: algorithms 2.3, with the outputs summed inside. Cost O(n M^2).
EvidenceGradient negative_log_evidence_gradient(const GpData& data, const Hyperparameters& hyperparameters,
                                                const Eigen::MatrixXd& pseudo_inputs, double jitter = default_jitter);

}  // namespace sila
