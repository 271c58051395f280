#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sila/gp/kernel.hpp"

namespace sila {

/// A sparse Gaussian process (FITC) with P outputs that share pseudo-inputs, kernel and noise, kept as whitened natural
/// statistics, so that data can be added and models fused when the data are gone.
/// D inputs, M pseudo-inputs, P outputs. Outputs are modelled as mean + GP of zero mean.
struct SparseGp {
  Kernel kernel;
  double noise_variance = 1.0;
  Eigen::MatrixXd pseudo_inputs;    ///< D x M, Z
  Eigen::VectorXd mean;             ///< P, constant mean of each output
  Eigen::MatrixXd information;      ///< M x M, G = V diag(1/lambda) V'
  Eigen::MatrixXd response;         ///< M x P, h = V diag(1/lambda) (y - mean)
  Eigen::VectorXd mean_response;    ///< M, e = V diag(1/lambda) 1; lets the constant mean be changed later
  double points = 0.0;              ///< how many data points were absorbed
  double jitter = 1e-6;             ///< relative to signal_variance; part of what the statistics are whitened with
};

/// Mean (P) and variance of the latent function at one point; the variance is common to the outputs.
struct GpPrediction {
  Eigen::VectorXd mean;
  double variance = 0.0;  ///< of f; add noise_variance for that of an observation
};

// The functions below are listed for orientation; the rest of the room (greedy selection, training, transfer, fusion) has headers of
// its own.

/// A GP that has seen nothing.
SparseGp empty_gp(const Kernel& kernel, double noise_variance, const Eigen::MatrixXd& pseudo_inputs, const Eigen::VectorXd& mean);

/// Adds data under the GP's own pseudo-inputs and kernel; exact and order-free (algorithms 3.2).
/// Shapes: inputs D x n, outputs n x P. `alpha` = 1: FITC, 0: DTC, between: Power EP.
SparseGp absorb(const SparseGp& gp, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs, double alpha = 1.0);

void validate(const SparseGp& gp);

}  // namespace sila
