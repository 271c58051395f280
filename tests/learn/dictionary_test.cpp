#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "learn/sparse_coding.hpp"
#include "learn/steps.hpp"
#include "sila/core/sampling.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

void expect_projection(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  EXPECT_LT((project_arrow(from) - to).norm(), 1e-14) << from.transpose();
}

TEST(ArrowProjection, GivesTheWorkedExamples) {
  expect_projection({1, 0, 0}, {.5, 0, .5});
  expect_projection({3, 4, 0}, {.6, .8, 1});
  expect_projection({0, 0, -1}, {0, 0, 0});
  expect_projection({.5, 0, 2}, {.5, 0, 1});
  expect_projection({2, 0, 3}, {1, 0, 1});
  expect_projection({.3, .4, -.6}, {0, 0, 0});
  expect_projection({.3, .4, .1}, {.18, .24, .3});
  expect_projection({.6, .8, 1}, {.6, .8, 1});
}

TEST(ArrowProjection, IsTheNearestFeasiblePoint) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-2.0, 2.0);
  for (int round = 0; round < 90; ++round) {
    SCOPED_TRACE("seed 5, round " + std::to_string(round));
    const Eigen::Vector3d point(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d nearest = project_arrow(point);
    EXPECT_LE(nearest.head<2>().norm(), nearest.z() + 1e-12);
    EXPECT_LE(nearest.z(), 1.0 + 1e-12);
    for (int probe = 0; probe < 300; ++probe) {  // no feasible point is nearer
      const double b = std::abs(uniform(random)) / 2.0, n = b * std::abs(uniform(random)) / 2.0,
                   angle = 3.2 * uniform(random);
      const Eigen::Vector3d other(n * std::cos(angle), n * std::sin(angle), b);
      EXPECT_LE((point - nearest).norm(), (point - other).norm() + 1e-12);
    }
  }
}

TEST(SparseCoding, SatisfiesTheOptimalityConditionsAndIsNeverNegative) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE("seed 9, round " + std::to_string(round));
    const Eigen::MatrixXd atoms = Eigen::MatrixXd::NullaryExpr(30, 8, [&](Eigen::Index) { return normal(random); });
    const Eigen::VectorXd signal = Eigen::VectorXd::NullaryExpr(30, [&](Eigen::Index) { return normal(random); });
    const Eigen::MatrixXd gram = atoms.transpose() * atoms;
    const Eigen::VectorXd products = atoms.transpose() * signal;
    const Eigen::VectorXd s = nonnegative_lasso(gram, products, 0.7, Eigen::VectorXd::Zero(8)).s;
    const Eigen::VectorXd slope = gram * s - products;
    for (Eigen::Index k = 0; k < 8; ++k) {
      EXPECT_GE(s(k), 0.0);
      EXPECT_GE(slope(k) + 0.7, -1e-3);
      if (s(k) > 0.0) {
        EXPECT_NEAR(slope(k) + 0.7, 0.0, 1e-3);
      }
    }
  }
}

const Grid kGrid{0.4, Vector2::Zero(), 8};

std::vector<GridVector> vectors_of_walks(int count, unsigned seed) {
  std::vector<GridVector> vectors;
  for (const FramedTrajectory& placed : testing::corner_walks(count, seed))
    vectors.push_back(to_grid_vector(resample(placed.track, placed.frame, {}), kGrid));
  return vectors;
}

TEST(Dictionary, NeverRaisesItsObjectiveAndKeepsEveryPrimitiveInItsSet) {
  for (unsigned seed : {1u, 2u, 3u}) {
    for (CutRule cut : {CutRule::aligned, CutRule::first_unexplained}) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      const std::vector<GridVector> vectors = vectors_of_walks(20, seed);
      const Dictionary dictionary = learn_dictionary(vectors, kGrid, 6.0, 10.0, {.cut = cut});
      EXPECT_GE(dictionary.primitives.size(), 3u);
      for (std::size_t i = 1; i < dictionary.objective.size(); ++i) {
        EXPECT_LE(dictionary.objective[i], dictionary.objective[i - 1] + 1e-9) << "step " << i;
      }
      EXPECT_LT(dictionary.objective.back(), 0.5 * dictionary.objective.front());
      for (const MotionPrimitive& primitive : dictionary.primitives) {
        for (const CellVelocity& arrow : primitive.cells) EXPECT_LE(arrow.velocity.norm(), 1.0 + 1e-12);
      }
      for (const auto& code : dictionary.codes) {
        for (const Coefficient& used : code) EXPECT_GT(used.value, 0.0);
      }
    }
  }
}

TEST(Dictionary, SupportMasksKeepPrimitivesLocalAndSharedBetweenRoutes) {
  const std::vector<GridVector> vectors = vectors_of_walks(20, 4);
  const Dictionary local = learn_dictionary(vectors, kGrid, 6.0, 10.0, {});
  const Dictionary global = learn_dictionary(vectors, kGrid, 6.0, 10.0, {.support_mask = false});
  const auto uses = [](const Dictionary& dictionary) {
    double sum = 0.0;
    for (const auto& code : dictionary.codes) sum += static_cast<double>(code.size());
    return sum / static_cast<double>(dictionary.codes.size());
  };
  EXPECT_GT(uses(local), 1.5);  // a route is a chain of primitives
  EXPECT_LT(uses(global), uses(local));
}

TEST(Dictionary, AlignedCutsEndAtTileBorders) {
  const Dictionary dictionary = learn_dictionary(vectors_of_walks(20, 6), kGrid, 6.0, 10.0, {});
  for (const MotionPrimitive& primitive : dictionary.primitives) {
    for (const CellVelocity& arrow : primitive.cells) {
      EXPECT_EQ(tile_of(kGrid, arrow.cell), tile_of(kGrid, primitive.cells.front().cell));
    }
  }
}

TEST(Dictionary, ActivenessForbidsPrimitivesOfOppositeSignThatCancel) {
  // Two routes that part: without the channel one could be coded as the other minus a piece.
  const std::vector<GridVector> vectors = vectors_of_walks(30, 8);
  const Dictionary dictionary = learn_dictionary(vectors, kGrid, 6.0, 10.0, {});
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    std::map<CellKey, std::pair<double, Vector2>>
        cells;  // sum of lengths, sum of vectors, in cells the track never visits
    for (const Coefficient& used : dictionary.codes[i]) {
      for (const CellVelocity& arrow : dictionary.primitives[static_cast<std::size_t>(used.primitive)].cells) {
        auto& [length, sum] = cells.try_emplace(arrow.cell, 0.0, Vector2::Zero()).first->second;
        length += used.value * arrow.velocity.norm();
        sum += used.value * arrow.velocity;
      }
    }
    double cancelled = 0.0;
    for (const auto& [cell, entry] : cells) cancelled += entry.first - entry.second.norm();
    EXPECT_LT(cancelled, 1.0) << "track " << i;
  }
}

GridVector in_widths(const Trajectory& track) {
  return to_grid_vector(resample(track, testing::square_frame(2.5, CurbScaling::mean_width), {}), kGrid);
}

TEST(GridVector, FindsEveryCrossedCellAndUnitHeadings) {
  const GridVector vector = in_widths(testing::walk("a", {{0.5, 0.5}, {20.5, 0.5}}, 4.0, 0.5));  // fast
  ASSERT_GE(vector.path.size(), 20u);
  for (std::size_t c = 0; c < vector.path.size(); ++c) {
    EXPECT_EQ(vector.path[c].y, 0);
    EXPECT_NEAR(vector.directions[c].norm(), 1.0, 1e-12);
    EXPECT_EQ(vector.path[c].x, vector.path[0].x + static_cast<int>(c));
  }
}

TEST(GridVector, StandingPeopleHaveNoHeadingAndReversalsNoArrow) {
  const Trajectory standing = testing::sampled(50, 0.1, [](int) { return Vector2(1.0, 1.0); });
  EXPECT_TRUE(in_widths(standing).path.empty());
  const GridVector back = in_widths(testing::walk("r", {{0, 0.5}, {3.5, 0.5}, {0, 0.5}}, 1.2));
  EXPECT_TRUE(std::ranges::any_of(back.directions, [](const Vector2& direction) { return direction.isZero(); }));
}

}  // namespace
}  // namespace sila
