#pragma once

#include <Eigen/Core>

namespace sila {

/// Minimises 1/2 s'Gs - products's + penalty * sum(s) over s >= 0 by cyclic coordinate descent from `start`; exact to
/// 1e-6 in s. Shapes: gram n x n symmetric positive semidefinite, products n, start n (>= 0). Columns of (near) zero
/// norm stay at 0. Source: algorithms 1.4.
Eigen::VectorXd nonnegative_lasso(const Eigen::MatrixXd& gram, const Eigen::VectorXd& products, double penalty,
                                  Eigen::VectorXd start);

}  // namespace sila
