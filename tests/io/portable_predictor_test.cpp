#include "io/portable_predictor.hpp"

#include <gtest/gtest.h>

#include "sila/model/packing.hpp"
#include "support/learnt.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

/// Of several episodes, so that GPs were fused.
PortablePredictor learnt() {
  const EpisodeConfig config;
  PortablePredictor predictor{{}, testing::square_frame(), config.sampling, config.predict};
  predictor.model = testing::learnt(testing::corner_walks(60, 1), config);
  predictor.sampling.acceleration_density = 1.5;
  predictor.predict.horizon_s = 4.0;
  return predictor;
}

TEST(PortablePredictor, IsTheSameBitForBitButForTheIdsOfBatches) {
  PortablePredictor before = learnt();
  ASSERT_FALSE(before.model.episode_ids.empty());
  const PortablePredictor after = predictor_of_bytes(predictor_bytes(before));
  EXPECT_TRUE(after.model.episode_ids.empty());
  before.model.episode_ids.clear();
  EXPECT_TRUE(identical(after.model, before.model));
  EXPECT_EQ(predictor_bytes(after), predictor_bytes(before));
  EXPECT_EQ(after.sampling.acceleration_density, 1.5);
  EXPECT_EQ(after.predict.horizon_s, 4.0);
  EXPECT_TRUE(same_site(after.frame, before.frame));
}

TEST(PortablePredictor, RejectsBytesThatAreCutOrAreNone) {
  const std::string bytes = predictor_bytes(learnt());
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{7}, std::size_t{100}, bytes.size() / 2, bytes.size() - 1})
    EXPECT_THROW(predictor_of_bytes(bytes.substr(0, length)), std::invalid_argument) << length;
  EXPECT_THROW(predictor_of_bytes("no predictor, but long enough for a length"), std::invalid_argument);
  PortablePredictor bad = learnt();
  bad.predict.horizon_s = -1.0;
  EXPECT_TRUE(says(message_of([&] { predictor_of_bytes(predictor_bytes(bad)); }), "horizon_s"));
}

}  // namespace
}  // namespace sila
