#include "refine/fourier_features.hpp"

#include <Eigen/Cholesky>

namespace sila {
namespace {

constexpr double kCorrectionRidge = 1.0;
/// Windows after which half of the share that would have been best is added.
constexpr double kHalfWindows = 50.0;

}  // namespace

Eigen::MatrixXd ridge_coefficients(const RegressionMoments& moments) {
  if (moments.weight <= 0.0) return {};
  Eigen::MatrixXd matrix = moments.features;
  matrix.diagonal().array() += kCorrectionRidge;
  const Eigen::MatrixXd solved = matrix.llt().solve(moments.products);
  if (!solved.allFinite()) return {};
  return solved.transpose();
}

double learnt_share(const RegressionMoments& past) {
  if (!(past.features.size() > 0 && past.features(0, 0) > 0.0)) return 0.0;
  return std::clamp(past.products(0, 0) / past.features(0, 0), 0.0, 1.0) * past.weight / (past.weight + kHalfWindows);
}

std::array<Vector2, kCorrectionKnots> at_knots(std::span<const Vector2> errors_mps) {
  std::array<Vector2, kCorrectionKnots> knots;
  for (std::size_t k = 0; k < knots.size(); ++k)  // the last step before the knot
    knots[k] = errors_mps[((k + 1) * errors_mps.size() + kCorrectionKnots - 1) / kCorrectionKnots - 1];
  return knots;
}

}  // namespace sila
