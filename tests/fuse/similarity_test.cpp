#include <gtest/gtest.h>

#include <stdexcept>

#include "fuse/steps.hpp"
#include "fuse_data.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

const MotionPrimitive kA = row_of_arrows(1, 4);
const MotionPrimitive kB = row_of_arrows(3, 6);
const MotionPrimitive kC = row_of_arrows(1, 3);
constexpr double kRounding = 1e-10;  // of the numbers below, given to ten digits

MotionPrimitive mean(const std::vector<const MotionPrimitive*>& members, PrimitiveMean how = PrimitiveMean::plain) {
  return mean_primitive(members, how);
}

std::vector<double> lengths(const MotionPrimitive& primitive) {
  std::vector<double> result;
  for (const CellVelocity& arrow : primitive.cells) result.push_back(arrow.velocity.norm());
  return result;
}

Model model_of(std::vector<MotionPrimitive> primitives) {
  Model model;
  model.primitives = std::move(primitives);
  return model;
}

TEST(Similarity, OfHalfOverlappingRowsIsOneHalf) {
  EXPECT_EQ(similarity(kA, kB), 0.5);
}

TEST(Similarity, OfThreeCommonCellsOfFour) {
  EXPECT_NEAR(similarity(kA, kC), 0.8660254038, kRounding);
}

TEST(Similarity, OfOppositeDirectionsIsMinusOne) {
  EXPECT_EQ(similarity(kA, row_of_arrows(1, 4, -1.0)), -1.0);
}

TEST(Similarity, OfATurnByThirtyDegrees) {
  EXPECT_NEAR(similarity(kA, row_of_arrows(1, 4, 1.0, 30.0)), 0.8660254038, kRounding);
}

TEST(Similarity, DoesNotDependOnScaleAndIsZeroForNothing) {
  EXPECT_EQ(similarity(kA, row_of_arrows(1, 4, 0.5)), 1.0);
  EXPECT_EQ(similarity(kA, row_of_arrows(1, 4, 0.0)), 0.0);
  EXPECT_EQ(similarity(kA, MotionPrimitive{}), 0.0);
}

TEST(Similarity, OfAPrimitiveWithItsTwoHalves) {
  const MotionPrimitive first = row_of_arrows(1, 2);
  const MotionPrimitive second = row_of_arrows(3, 4);
  EXPECT_NEAR(similarity(kA, first), 0.7071067812, kRounding);
  EXPECT_NEAR(similarity(kA, second), 0.7071067812, kRounding);
  EXPECT_EQ(similarity(first, second), 0.0);
}

TEST(Similarity, IsSymmetricAndOneWithItself) {
  for_seeds(50, [](Random& random) {
    const Model model = random_model(random);
    for (const MotionPrimitive& a : model.primitives) {
      EXPECT_NEAR(similarity(a, a), 1.0, 1e-12);  // rounding of a sum of at most 25 squares
      for (const MotionPrimitive& b : model.primitives) EXPECT_EQ(similarity(a, b), similarity(b, a));
    }
  });
}

TEST(SimilarityGraph, HoldsExactlyThePairsThatReachTheThreshold) {
  std::size_t edges = 0;
  for_seeds(50, [&](Random& random) {
    const Model previous = random_model(random);
    const Model incoming = random_model(random);
    const double threshold = uniform(random, 0.05, 1.0);
    SimilarityEdges expected;
    const int shift = static_cast<int>(previous.primitives.size());
    for (int i = 0; i < shift; ++i) {
      for (std::size_t j = 0; j < incoming.primitives.size(); ++j) {
        const double s = similarity(previous.primitives[static_cast<std::size_t>(i)], incoming.primitives[j]);
        if (s >= threshold - 1e-9) expected.push_back({i, shift + static_cast<int>(j), s});
      }
    }
    EXPECT_EQ(similarity_graph(previous, incoming, threshold), expected);
    edges += expected.size();
  });
  EXPECT_GT(edges, 0u);
}

TEST(SimilarityGraph, MatchesAtTheThresholdDespiteRounding) {
  EXPECT_EQ(similarity_graph(model_of({kA}), model_of({kB}), 0.5).size(), 1u);
  EXPECT_EQ(similarity_graph(model_of({kA}), model_of({kB}), 0.7).size(), 0u);
  const MotionPrimitive uneven = row_of_arrows(0, 6, 0.3, 17.0);
  EXPECT_EQ(similarity_graph(model_of({uneven}), model_of({uneven}), 1.0).size(), 1u);
}

TEST(SimilarityGraph, RejectsAThresholdThatIsNotPositive) {
  EXPECT_THROW(similarity_graph(model_of({kA}), model_of({kB}), 0.0), std::invalid_argument);
}

TEST(SimilarityGraph, AsksForThePairsWithACommonNeighbourOnly) {
  const Model previous = model_of({kA, row_of_arrows(20, 23)});
  const Model incoming = model_of({row_of_arrows(1, 4), kC, row_of_arrows(20, 22)});
  const auto leaves = leaf_similarities(similarity_graph(previous, incoming, 0.5), previous, incoming);
  ASSERT_EQ(leaves.size(), 1u);
  EXPECT_EQ(leaves[0].first, 2);
  EXPECT_EQ(leaves[0].second, 3);
  EXPECT_NEAR(leaves[0].value, 0.8660254038, kRounding);
}

TEST(MeanPrimitive, FadesWhereOneHasNoArrow) {
  const MotionPrimitive both = mean({&kA, &kC});
  EXPECT_EQ(lengths(both), (std::vector<double>{1, 1, 1, 0.5}));
  EXPECT_NEAR(similarity(both, kC), 0.9607689228, kRounding);
  EXPECT_NEAR(similarity(both, kA), 0.9707253434, kRounding);
}

TEST(MeanPrimitive, OfThreeCountsEachAThird) {
  const std::vector<double> expected{2 / 3., 2 / 3., 1, 2 / 3., 1 / 3., 1 / 3.};
  const std::vector<double> found = lengths(mean({&kA, &kC, &kB}));
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t c = 0; c < found.size(); ++c) EXPECT_NEAR(found[c], expected[c], 1e-15) << c;
}

TEST(MeanPrimitive, OfARightAnglePointsBetween) {
  const MotionPrimitive turned = row_of_arrows(1, 4, 1.0, 90.0);
  for (const CellVelocity& arrow : mean({&kA, &turned}).cells) {
    EXPECT_NEAR(arrow.velocity.x(), 0.5, 1e-15);
    EXPECT_NEAR(arrow.velocity.y(), 0.5, 1e-15);
  }
}

TEST(MeanPrimitive, AddsWeightsAndCountsThemIfAsked) {
  const MotionPrimitive heavy = row_of_arrows(1, 4, 1.0, 0.0, 3.0);
  const MotionPrimitive light = row_of_arrows(1, 3);
  EXPECT_EQ(mean({&heavy, &light}).weight, 4.0);
  EXPECT_EQ(lengths(mean({&heavy, &light}, PrimitiveMean::plain)).back(), 0.5);
  EXPECT_EQ(lengths(mean({&heavy, &light}, PrimitiveMean::count)).back(), 0.75);
}

TEST(MeanPrimitive, DropsFadedArrowsButNotTheLongest) {
  MotionPrimitive a = row_of_arrows(1, 2);
  a.cells[1].velocity *= 0.09;
  EXPECT_EQ(mean({&a, &kC}).cells.size(), 3u);  // cell 3 of C is halved, not faded
  const MotionPrimitive first = row_of_arrows(1, 1);
  EXPECT_EQ(mean({&a, &first}).cells.size(), 1u);  // 0.045
  const MotionPrimitive faint = row_of_arrows(1, 3, 0.01);
  EXPECT_EQ(mean({&faint, &faint}).cells.size(), 3u);
}

TEST(MeanPrimitive, RejectsNoMembersAndThoseThatCancelOut) {
  const MotionPrimitive opposite = row_of_arrows(1, 4, -1.0);
  EXPECT_THROW(mean({}), std::invalid_argument);
  EXPECT_THROW(mean({&kA, &opposite}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
