#include "sila/learn/sparse_coding.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sila {
namespace {
constexpr int kMaxSweeps = 200;
constexpr double kTolerance = 1e-6;
constexpr double kSmallestNorm = 1e-10;
}  // namespace

Eigen::VectorXd nonnegative_lasso(const Eigen::MatrixXd& gram, const Eigen::VectorXd& products, double penalty,
                                  Eigen::VectorXd start) {
  Eigen::VectorXd s = std::move(start);
  Eigen::VectorXd gram_s = gram * s;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0.0;
    for (Eigen::Index k = 0; k < s.size(); ++k) {
      if (gram(k, k) < kSmallestNorm) continue;
      const double value = std::max(0.0, s(k) + (products(k) - gram_s(k) - penalty) / gram(k, k));
      const double step = value - s(k);
      if (step == 0.0) continue;
      s(k) = value;
      gram_s += step * gram.col(k);
      change = std::max(change, std::abs(step));
    }
    if (change < kTolerance) break;
  }
  return s;
}

}  // namespace sila
