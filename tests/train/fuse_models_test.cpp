#include <gtest/gtest.h>

#include "sila/train/episode.hpp"
#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

TEST(FuseModels, AddsTheErrorStatisticsOfEachSite) {
  Random random(3);
  Model previous = random_model(random);
  Model incoming = random_increment(random).model;
  incoming.sites[0].frame.origin_m = {100.0, 0.0};
  ErrorStatistics statistics = zero_error_statistics(2, 0.2, 3.2);
  statistics.novelties[3] = 1.0;
  previous.refinement.error_statistics = {statistics};
  statistics.novelties[3] = 2.0;
  incoming.refinement.error_statistics = {statistics};
  const Model apart = fuse_models(previous, incoming, {}).model;
  ASSERT_EQ(apart.refinement.error_statistics.size(), 2u);
  EXPECT_EQ(apart.refinement.error_statistics[0].novelties[3], 1.0);
  EXPECT_EQ(apart.refinement.error_statistics[1].novelties[3], 2.0);
  const Model one = fuse_models(apart, incoming, {}).model;
  ASSERT_EQ(one.refinement.error_statistics.size(), 2u);
  EXPECT_EQ(one.refinement.error_statistics[1].novelties[3], 4.0);
  incoming.refinement.error_statistics = {zero_error_statistics(4, 0.2, 3.2)};
  EXPECT_TRUE(
      says(message_of([&] { fuse_models(previous, incoming, {}); }),
           "expected those of sampling.interval_s = 0.2, predict.horizon_s = 0.4 and predict.observe_s = 3.2, found "
           "those of sampling.interval_s = 0.2, predict.horizon_s = 0.8"));
}

}  // namespace
}  // namespace sila
