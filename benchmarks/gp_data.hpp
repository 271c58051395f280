#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "sila/gp/sparse_gp.hpp"

namespace sila::benchmarks {

/// Samples of a few people who walk along one bent path, as a transition sees them: clumped, elongated, noisy
/// velocities.
inline GpData transition_data(int points, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  GpData data{Eigen::MatrixXd(2, points), Eigen::MatrixXd(points, 2)};
  constexpr int points_per_person = 25;
  for (int n = 0; n < points; ++n) {
    const int person = n / points_per_person;
    const double along = 12.0 * (n % points_per_person) / points_per_person;
    const double offset = 0.6 * std::sin(2.4 * person);
    const double heading = 0.1 * along;
    data.inputs.col(n) << along * std::cos(0.05 * along) - offset * std::sin(heading) + 0.05 * normal(engine),
        along * std::sin(0.05 * along) + offset * std::cos(heading) + 0.05 * normal(engine);
    const double speed = 1.2 + 0.25 * std::cos(1.7 * person) - 0.3 * std::exp(-std::pow(along - 7.0, 2));
    data.outputs.row(n) << speed * std::cos(heading) + 0.15 * normal(engine),
        speed * std::sin(heading) + 0.15 * normal(engine);
  }
  return data;
}

inline Hyperparameters walking_theta() {
  return {{0.64, Eigen::Vector2d(2.0, 2.0)}, 0.09};
}

}  // namespace sila::benchmarks
