#include "refine/refine.hpp"

#include <gtest/gtest.h>

#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

TEST(RefinedFuse, RejectsResidualsOfAnotherHorizon) {
  Random random(4);
  Model previous = random_model(random);
  const Increment incoming = random_increment(random);
  previous.refinement.residual_settings = {4.8, 4};
  EXPECT_TRUE(says(message_of([&] { fuse(previous, incoming, {}, {}); }),
                   "fuse: the models have different settings: horizon of residual GPs [s] = 4.8 and 0"));
  EXPECT_TRUE(says(message_of([&] { accumulate(previous, incoming, {}); }), "accumulate: "));
}

}  // namespace
}  // namespace sila
