#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "gp/fit.hpp"
#include "sila/model/model.hpp"

namespace sila {

using Random = std::mt19937_64;

inline int integer(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}
inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Runs a law with seeds 1 .. seeds and names the seed that breaks it.
template <class Law>
void for_seeds(int seeds, Law law) {
  for (int seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(static_cast<std::uint64_t>(seed));
    law(random);
    if (::testing::Test::HasFailure()) return;
  }
}

inline double total_count(const Model& model) {
  double total = 0.0;
  for (const Transition& transition : model.transitions) total += transition.count;
  return total;
}

inline double total_points(const Model& model) {
  double total = 0.0;
  for (const Transition& transition : model.transitions) total += transition.field.gp.points;
  return total;
}

/// A patch of up to 5 x 5 cells that overlaps with others, all arrows of at least 0.3 in about one of two opposite
/// directions.
inline MotionPrimitive random_primitive(Random& random) {
  const CellKey corner{integer(random, 0, 2), integer(random, 0, 1)};
  const int width = integer(random, 2, 5);
  const int height = integer(random, 3, 5);
  const double heading = std::numbers::pi * integer(random, 0, 1) + uniform(random, -0.3, 0.3);
  MotionPrimitive primitive;
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y < height; ++y) {
      const double angle = heading + uniform(random, -0.2, 0.2);
      primitive.cells.push_back(
          {CellKey{corner.x + x, corner.y + y}, uniform(random, 0.3, 1.0) * Vector2(std::cos(angle), std::sin(angle))});
    }
  }
  return primitive;
}

inline GpData random_samples(Random& random) {
  const Eigen::Index points = integer(random, 3, 12);
  GpData samples{Eigen::MatrixXd(2, points), Eigen::MatrixXd(points, 2)};
  for (Eigen::Index n = 0; n < points; ++n) {
    const Vector2 place(uniform(random, 0, 8), uniform(random, 0, 8));
    samples.inputs.col(n) = place;
    samples.outputs.row(n) << std::sin(0.5 * place.x()), std::cos(0.5 * place.y());
  }
  return samples;
}

inline FlowField field_of(const GpData& samples) {
  const Hyperparameters hyperparameters{{0.5, Eigen::VectorXd::Constant(2, 2.0)}, 0.05};
  FlowField field{fit_sparse_gp(samples, hyperparameters, GpConfig{}), {}};
  for (Eigen::Index n = 0; n < samples.inputs.cols(); ++n) field.extent.extend(Vector2(samples.inputs.col(n)));
  return field;
}

/// A model as one batch might give, with the samples of its transitions.
inline Increment random_increment(Random& random) {
  Increment increment;
  Model& model = increment.model;
  model.episodes = 1;
  model.tracks = integer(random, 1, 20);
  model.sites = {{CurbFrame{}, 1, model.tracks}};
  const int primitives = integer(random, 1, 8);
  for (int p = 0; p < primitives; ++p) model.primitives.push_back(random_primitive(random));
  std::set<std::pair<int, int>> pairs;
  for (int p = 0; p < primitives; ++p) pairs.emplace(p, integer(random, 0, primitives - 1));
  for (int p = 0; p < primitives; ++p) pairs.emplace(integer(random, 0, primitives - 1), p);
  for (const auto& [from, to] : pairs) {
    increment.samples.push_back(random_samples(random));
    const double count = integer(random, 1, 6);
    model.transitions.push_back({from, to, count, field_of(increment.samples.back()), {{0, count, 1}}});
  }
  return increment;
}

inline Model random_model(Random& random) {
  return random_increment(random).model;
}

}  // namespace sila
