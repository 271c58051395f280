#include "sila/refine/learning_curve.hpp"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "core/concatenate.hpp"

namespace sila {
namespace {

constexpr int kLeastPoints = 4;

/// The regressors of a curve after `tracks`.
Eigen::Vector2d regressors(double tracks) {
  if (!(tracks > 0.0)) throw invalid_argument("learning_curve: tracks = ", tracks, ", must be positive");
  return {1.0, 1.0 / std::sqrt(tracks)};
}

void require_valid(const PrequentialError& error) {
  for (double sum_m : {error.model_m, error.constant_m}) {
    if (std::isfinite(sum_m) && sum_m >= 0.0) continue;
    throw invalid_argument("learning_curve: an error of ", sum_m, " m, must be finite and not negative");
  }
}

/// The 95 % quantile of Student's t to 0.05. Source: Abramowitz and Stegun, 26.7.5.
double student_quantile_95(int degrees_of_freedom) {
  constexpr double z = 1.6448536269514722, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double n = degrees_of_freedom;
  return z + (z3 + z) / (4.0 * n) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n) +
         (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n);
}

/// One equation of the regression.
struct Row {
  Eigen::Vector2d x;
  double ratio = 0.0;
  double weight = 0.0;
};

std::vector<Row> rows_of(std::span<const LearningPoint> points) {
  std::vector<Row> rows;
  for (const auto& [tracks, error] : points) {
    require_valid(error);
    if (error.windows == 0 || error.constant_m <= 0.0) continue;
    rows.push_back({regressors(tracks), error.ratio(), static_cast<double>(error.windows)});
  }
  return rows;
}

}  // namespace

std::optional<LearningCurve> fit_learning_curve(std::span<const LearningPoint> points) {
  const std::vector<Row> rows = rows_of(points);
  if (rows.size() < kLeastPoints) return std::nullopt;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d products = Eigen::Vector2d::Zero();
  for (const auto& [x, ratio, weight] : rows) {
    normal += weight * x * x.transpose();
    products += weight * ratio * x;
  }
  const Eigen::FullPivLU<Eigen::Matrix2d> solver(normal);
  if (!solver.isInvertible()) return std::nullopt;
  const Eigen::Vector2d coefficients = solver.solve(products);
  double squares = 0.0;
  for (const auto& [x, ratio, weight] : rows) squares += weight * std::pow(ratio - x.dot(coefficients), 2);
  const double variance = squares / static_cast<double>(rows.size() - 2);
  return LearningCurve{coefficients, variance * solver.inverse(), static_cast<int>(rows.size())};
}

Estimate expected_error(const LearningCurve& curve, double tracks) {
  const Eigen::Vector2d x = regressors(tracks);
  const double value = x.dot(curve.coefficients);
  const double reach = student_quantile_95(curve.points - 2) * std::sqrt(x.dot(curve.covariance * x));
  return {value, value - reach, value + reach};
}

}  // namespace sila
