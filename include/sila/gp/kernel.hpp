#pragma once

#include <Eigen/Core>

namespace sila {

/// Squared exponential with one length scale per input dimension:
/// k(x, z) = signal_variance * exp(-1/2 * sum_d (x_d - z_d)^2 / length_scales_d^2).
/// Invariant: everything positive and finite, at least one dimension.
struct Kernel {
  double signal_variance = 1.0;
  Eigen::VectorXd length_scales = Eigen::VectorXd::Ones(2);
};

/// Same numbers, bit for bit.
bool operator==(const Kernel& a, const Kernel& b);

/// Shapes: a is D x n, b is D x m (one point a column); the result is n x m.
/// Throws: std::invalid_argument if a or b has not D rows or the kernel is not valid.
Eigen::MatrixXd covariance(const Kernel& kernel, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Throws: std::invalid_argument naming the first number that is not positive and finite.
void validate(const Kernel& kernel);

}  // namespace sila
