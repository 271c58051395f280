#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

namespace sila {

/// The solution of a lasso: the coefficients, and the gram matrix times them.
struct LassoSolution {
  Eigen::VectorXd s;
  Eigen::VectorXd gram_s;
};

/// G s, reading only the columns of coefficients that are not zero.
Eigen::VectorXd gram_times(const auto& gram, const Eigen::VectorXd& s) {
  Eigen::VectorXd product = Eigen::VectorXd::Zero(s.size());
  for (Eigen::Index k = 0; k < s.size(); ++k) {
    if (s(k) == 0.0) continue;
    for (Eigen::Index i = 0; i < s.size(); ++i) product(i) += s(k) * gram(i, k);
  }
  return product;
}

/// Minimises 1/2 s'Gs - products's + penalty * sum(s) over s >= 0 by cyclic coordinate descent from `start`, until no
/// coefficient moves by more than 1e-6 in a sweep, at most 200 sweeps (then columns were nearly collinear). `gram(i,
/// k)` gives an entry of G: only columns of coefficients that move are read, so that a part of a large matrix need not
/// be copied. Shapes: G n x n symmetric positive semidefinite, products n, start n (>= 0). Columns of (near) zero norm
/// stay as they are. Source: docs/learn.md, section 3.
LassoSolution nonnegative_lasso(const auto& gram, const Eigen::VectorXd& products, double penalty,
                                Eigen::VectorXd start) {
  constexpr int max_sweeps = 200;
  constexpr double tolerance = 1e-6, smallest_norm = 1e-10;
  Eigen::VectorXd gram_start = gram_times(gram, start);
  LassoSolution found{std::move(start), std::move(gram_start)};
  const Eigen::Index count = found.s.size();
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    double change = 0.0;
    for (Eigen::Index k = 0; k < count; ++k) {
      if (found.s(k) <= 0.0 && products(k) - found.gram_s(k) <= penalty) continue;  // stays at 0
      const double norm = gram(k, k);
      if (norm < smallest_norm) continue;
      const double value = std::max(0.0, found.s(k) + (products(k) - found.gram_s(k) - penalty) / norm);
      const double step = value - found.s(k);
      if (step == 0.0) continue;
      found.s(k) = value;
      for (Eigen::Index i = 0; i < count; ++i) found.gram_s(i) += step * gram(i, k);
      change = std::max(change, std::abs(step));
    }
    if (change < tolerance) break;
  }
  return found;
}

}  // namespace sila
