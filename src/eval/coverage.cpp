#include "sila/eval/coverage.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace sila {
namespace {

constexpr int kRings = 24;
constexpr int kSpokes = 16;

struct Gaussian {
  double weight;
  Vector2 mean_m;
  Matrix2 inverse;
  double scale;  ///< weight over the norm of the density

  double density(const Vector2& point_m) const {
    const Vector2 error = point_m - mean_m;
    return scale * std::exp(-0.5 * error.dot(inverse * error));
  }
};

double density(const std::vector<Gaussian>& mixture, const Vector2& point_m) {
  double sum = 0.0;
  for (const Gaussian& part : mixture) sum += part.density(point_m);
  return sum;
}

/// The share of one part's mass on points where the mixture is denser than `level`: rings of equal mass, spokes of
/// equal angle, every other ring turned by half a spoke.
double share_above(const std::vector<Gaussian>& mixture, const Gaussian& part, const Matrix2& root, double level) {
  int above = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - (ring + 0.5) / kRings));
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      const double angle = 2.0 * std::numbers::pi * (spoke + 0.5 * (ring % 2)) / kSpokes;
      const Vector2 point_m = part.mean_m + root * Vector2(radius * std::cos(angle), radius * std::sin(angle));
      above += density(mixture, point_m) > level;
    }
  }
  return static_cast<double>(above) / (kRings * kSpokes);
}

}  // namespace

double mass_above(const Prediction& prediction, std::size_t step, const Vector2& truth_m) {
  if (prediction.modes.empty() || prediction.modes.front().path_m.size() <= step) {
    throw std::invalid_argument("mass_above: step = " + std::to_string(step) + ", the prediction is shorter");
  }
  std::vector<Gaussian> mixture;
  for (const Mode& mode : prediction.modes) {
    const Matrix2& covariance = mode.covariances_m2[step];
    const double norm = 2.0 * std::numbers::pi * std::sqrt(covariance.determinant());
    mixture.push_back({mode.weight, mode.path_m[step], covariance.inverse(), mode.weight / norm});
  }
  if (mixture.size() == 1) {
    const Vector2 error = truth_m - mixture.front().mean_m;
    return 1.0 - std::exp(-0.5 * error.dot(mixture.front().inverse * error));
  }
  const double level = density(mixture, truth_m);
  double mass = 0.0;
  for (std::size_t m = 0; m < mixture.size(); ++m) {
    const Matrix2 root = prediction.modes[m].covariances_m2[step].llt().matrixL();
    mass += mixture[m].weight * share_above(mixture, mixture[m], root, level);
  }
  return mass;
}

}  // namespace sila
