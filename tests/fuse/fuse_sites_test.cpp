#include <gtest/gtest.h>

#include "fuse_data.hpp"
#include "sila/model/packing.hpp"
#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

TEST(Fuse, JoinsSites) {
  Random random(3);
  Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.model.sites[0].frame.origin_m = {100.0, 0.0};
  const Model apart = fuse(previous, incoming).model;
  ASSERT_EQ(apart.sites.size(), 2u);
  EXPECT_EQ(apart.sites[1].tracks, incoming.model.tracks);
  const Model one = fuse(apart, incoming).model;
  ASSERT_EQ(one.sites.size(), 2u);
  EXPECT_EQ(one.sites[1].episodes, 2);
  EXPECT_EQ(one.sites[0].episodes, 1);
}

TEST(Fuse, OfSitesThatAreApartIsAsAccumulating) {
  for_seeds(30, [](Random& random) {
    const Model here = random_model(random);
    Increment elsewhere = random_increment(random);
    elsewhere.model.sites[0].frame.origin_m = {100.0, 0.0};
    const FuseConfig config = with_threshold(uniform(random, 0.3, 0.9));
    const Model apart = fuse(here, elsewhere, config).model;
    EXPECT_TRUE(identical(apart, accumulate(here, elsewhere).model));
    check(apart);
    // Each site goes on as if the other were not there.
    const Increment more = random_increment(random);
    EXPECT_EQ(size(fuse(apart, more, config).model), size(fuse(here, more, config).model) + size(elsewhere.model));
  });
}

TEST(Fuse, KeepsCountsBySiteWhateverFuses) {
  int of_both = 0;
  for_seeds(50, [&](Random& random) {
    FuseConfig config = with_threshold(uniform(random, 0.3, 0.9));
    config.sites = SiteSharing::shared;
    config.split_credit = integer(random, 0, 1) == 1;
    Model model;
    double by_site[2] = {0.0, 0.0}, credit = 0.0;
    for (int episode = 0; episode < 6; ++episode) {
      Increment batch = random_increment(random);
      batch.model.sites[0].frame.origin_m.x() = 100.0 * (episode % 2);
      by_site[episode % 2] += total_count(batch.model);
      const FuseResult fused = fuse(model, batch, config);
      credit += counts_of(fused.plan, model, batch).split_credit;
      model = fused.model;
      check(model);
    }
    double left[2] = {0.0, 0.0};
    for (const Transition& transition : model.transitions) {
      for (const SiteCount& part : transition.sites) left[part.site] += part.count;
      of_both += transition.sites.size() == 2;
    }
    EXPECT_EQ(left[0] + left[1], by_site[0] + by_site[1] + credit);
    if (credit == 0.0) {
      EXPECT_EQ(left[0], by_site[0]);
    }
  });
  EXPECT_GT(of_both, 20);
}

TEST(Fuse, CannotPartSitesThatAreShared) {
  Random random(4);
  FuseConfig shared;
  shared.sites = SiteSharing::shared;
  const Model here = random_model(random);
  Increment elsewhere = random_increment(random);
  EXPECT_NO_THROW(fuse(fuse(here, elsewhere, shared).model, elsewhere));  // of one site
  elsewhere.model.sites[0].frame.origin_m = {100.0, 0.0};
  const Model both = fuse(here, elsewhere, shared).model;
  EXPECT_TRUE(says(message_of([&] { fuse(both, elsewhere); }), "keep fuse.sites = shared"));
  EXPECT_NO_THROW(fuse(fuse(here, elsewhere).model, elsewhere, shared));
}

}  // namespace
}  // namespace sila
