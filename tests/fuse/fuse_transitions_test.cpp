#include <gtest/gtest.h>

#include "fuse_data.hpp"
#include "gp/example.hpp"
#include "gp/fuse_gps.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

/// A model with the given primitives and transitions from one to the other, each with samples of its own.
Increment increment_of(std::vector<MotionPrimitive> primitives, const std::vector<TransitionCount>& transitions,
                       std::uint64_t seed) {
  Random random(seed);
  Increment increment;
  increment.model.primitives = std::move(primitives);
  increment.model.episodes = 1;
  increment.model.sites = {{CurbFrame{}, 1, 1}};
  for (const TransitionCount& edge : transitions) {
    increment.samples.push_back(random_samples(random));
    increment.model.transitions.push_back(
        {edge.from, edge.to, edge.count, field_of(increment.samples.back()), {{0, edge.count, 1}}});
  }
  return increment;
}

const std::vector<MotionPrimitive> kTwoRows{row_of_arrows(0, 3), row_of_arrows(10, 13)};

TEST(Fuse, ReplacesAPrimitiveByItsTwoHalves) {
  const std::vector<MotionPrimitive> halves{row_of_arrows(1, 2), row_of_arrows(3, 4)};
  const Model previous = increment_of(halves, {{0, 1, 4}}, 1).model;
  const Increment incoming = increment_of({row_of_arrows(1, 4), row_of_arrows(9, 12)}, {{0, 1, 1}, {1, 0, 2}}, 2);
  const FuseResult fused = fuse(previous, incoming, with_threshold(0.7));
  const FuseCounts counts = counts_of(fused.plan, previous, incoming);
  ASSERT_EQ(counts.case_1, 1);
  ASSERT_EQ(fused.model.primitives.size(), 3u);
  EXPECT_TRUE(same(fused.model.primitives[0], halves[0]));
  EXPECT_TRUE(same(fused.model.primitives[1], halves[1]));
  ASSERT_EQ(fused.model.transitions.size(), 3u);
  const Transition& between = fused.model.transitions[0];
  EXPECT_EQ(std::pair(between.from, between.to), std::pair(0, 1));
  EXPECT_EQ(between.count, 4 + 2);  // two came to the split primitive, one left it
  EXPECT_EQ(counts.split_credit, 2.0);
  EXPECT_EQ(std::pair(fused.model.transitions[1].from, fused.model.transitions[1].to), std::pair(1, 2));
  EXPECT_EQ(std::pair(fused.model.transitions[2].from, fused.model.transitions[2].to), std::pair(2, 0));
  const FuseResult apart = fuse(previous, incoming, with_threshold(0.71));
  EXPECT_EQ(counts_of(apart.plan, previous, incoming).case_1, 0);  // 1/sqrt(2) is below
}

TEST(Fuse, TakesSamplesInPlaceOfTheGpsThatWereTrainedOnThem) {
  const Increment first = increment_of(kTwoRows, {{0, 1, 3}}, 3);
  const Increment second = increment_of(kTwoRows, {{0, 1, 2}}, 4);
  const FuseResult fused = fuse(first.model, second);
  ASSERT_EQ(counts_of(fused.plan, first.model, second).fused, 1);
  const SparseGp& old = first.model.transitions[0].field.gp;
  const std::vector<const SparseGp*> parts{&old};
  const SparseGp expected =
      fuse_gps(parts, second.samples[0], GpConfig{}, Hyperparameters{old.kernel, old.noise_variance});
  EXPECT_TRUE(fused.model.transitions[0].field.gp == expected);
  EXPECT_EQ(fused.model.transitions[0].count, 5.0);
}

TEST(Fuse, WithoutSamplesFusesBothStoredGps) {
  const Increment first = increment_of(kTwoRows, {{0, 1, 3}}, 3);
  const Increment second = increment_of(kTwoRows, {{0, 1, 2}}, 4);
  const FuseResult fused = fuse(first.model, {second.model, {}});
  const std::vector<const SparseGp*> parts{&first.model.transitions[0].field.gp, &second.model.transitions[0].field.gp};
  const GpData none{Eigen::MatrixXd(2, 0), Eigen::MatrixXd(0, 2)};
  EXPECT_TRUE(fused.model.transitions[0].field.gp == fuse_gps(parts, none, GpConfig{}));
}

TEST(Fuse, FitsATransitionOfTheIncrementAloneToItsPooledSamples) {
  // Both incoming rows are fused into the first previous one (case 2), so their two transitions become one.
  const Model previous = increment_of({row_of_arrows(0, 3)}, {}, 5).model;
  const Increment incoming =
      increment_of({row_of_arrows(0, 3), row_of_arrows(0, 2), row_of_arrows(10, 13)}, {{0, 2, 1}, {1, 2, 2}}, 6);
  const FuseResult fused = fuse(previous, incoming);
  const FuseCounts counts = counts_of(fused.plan, previous, incoming);
  ASSERT_EQ(counts.case_2, 1);
  ASSERT_EQ(counts.refitted, 1);
  ASSERT_EQ(fused.model.transitions.size(), 1u);
  const GpData pooled = gp_tests::joined(incoming.samples[0], incoming.samples[1]);
  EXPECT_TRUE(same(fused.model.transitions[0].field, field_of(pooled)));
  EXPECT_EQ(fused.model.transitions[0].count, 3.0);
}

}  // namespace
}  // namespace sila
