#include "refine/fourier_features.hpp"

#include <Eigen/Cholesky>

namespace sila {
namespace {

constexpr double kCorrectionRidge = 1.0;
/// Sum of weights, about 50 windows, at which half of the best factor is used.
constexpr double kHalfWeight = 40.0;
/// Errors have Student's distribution with one degree of freedom and this scale: a step of iteratively reweighted least
/// squares (Lange, Little, Taylor 1989).
constexpr double kTypicalError_mps = 0.6;

}  // namespace

Eigen::MatrixXd solve_ridge(const RegressionMoments& moments) {
  if (moments.weight <= 0.0) return {};
  Eigen::MatrixXd matrix = moments.features.selfadjointView<Eigen::Lower>();
  matrix.diagonal().array() += kCorrectionRidge;
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  Eigen::MatrixXd solved = factor.solve(moments.products);
  // Features of the wide kernel are nearly collinear. One step of iterative refinement (Golub and Van Loan 2013,
  // section 3.5.3) makes the coefficients the same on every machine but for rounding.
  using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Exact left = moments.products.cast<long double>() - matrix.cast<long double>() * solved.cast<long double>();
  solved += factor.solve(left.cast<double>());
  if (!solved.allFinite()) return {};
  return solved.transpose();
}

double learnt_share(const RegressionMoments& past) {
  if (!(past.features.size() > 0 && past.features(0, 0) > 0.0)) return 0.0;
  return std::clamp(past.products(0, 0) / past.features(0, 0), 0.0, 1.0) * past.weight / (past.weight + kHalfWeight);
}

void add_to_share(RegressionMoments& past, double square, double product, double weight) {
  past.weight += weight;
  past.features(0, 0) += weight * square;
  past.products(0, 0) += weight * product;
}

KnotErrors knot_errors(std::span<const Vector2> errors_mps) {
  KnotErrors knots;
  double square = 0.0;
  for (Eigen::Index k = 0; k < kCorrectionKnots; ++k) {
    const std::size_t end = static_cast<std::size_t>(k + 1) * errors_mps.size();
    knots.at_mps.col(k) = errors_mps[(end + kCorrectionKnots - 1) / kCorrectionKnots - 1];  // at or after the knot
    square += knots.at_mps.col(k).squaredNorm() / kCorrectionKnots;
  }
  knots.weight = 1.0 / (1.0 + square / (kTypicalError_mps * kTypicalError_mps));
  return knots;
}

}  // namespace sila
