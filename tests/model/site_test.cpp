#include "sila/model/site.hpp"

#include <gtest/gtest.h>

#include "support/walks.hpp"

namespace sila {
namespace {

CurbFrame frame_at(double x_m) {
  CurbFrame frame = testing::square_frame();
  frame.origin_m.x() = x_m;
  return frame;
}

TEST(Site, IsKnownByItsCornerAndCurbs) {
  CurbFrame corner = frame_at(0.0), near = frame_at(0.8), turned = corner;
  turned.axis_1 = {0, 1};
  turned.axis_2 = {-1, 0};
  EXPECT_TRUE(same_site(corner, near));
  EXPECT_FALSE(same_site(corner, turned));
  EXPECT_FALSE(same_site(corner, frame_at(1.2)));
  std::vector<Site> sites{{corner, 1, 20}};
  EXPECT_EQ(find_site(sites, near), 0);
  EXPECT_EQ(find_site(sites, turned), std::nullopt);
  EXPECT_EQ(find_or_add_site(sites, turned), 1);
  EXPECT_EQ(find_or_add_site(sites, turned), 1);
  EXPECT_EQ(sites.size(), 2u);
}

TEST(Site, JoinsThoseOfTwoModelsByCorner) {
  const std::vector<Site> first{{frame_at(0), 1, 20}, {frame_at(50), 2, 40}};
  const std::vector<Site> second{{frame_at(90), 3, 60}, {frame_at(0.5), 4, 80}};
  const JoinedSites joined = join_sites(first, second);
  EXPECT_EQ(joined.of_second, (std::vector<int>{2, 0}));
  ASSERT_EQ(joined.sites.size(), 3u);
  EXPECT_EQ(joined.sites[0].episodes, 5);
  EXPECT_EQ(joined.sites[0].tracks, 100);
}

TEST(Site, CountsStaySortedAndAddUp) {
  std::vector<SiteCount> counts;
  for (const SiteCount& part : {SiteCount{3, 1.0, 2}, SiteCount{1, 2.0, 5}, SiteCount{3, 4.0, 1}})
    add_count(counts, part);
  EXPECT_EQ(counts, (std::vector<SiteCount>{{1, 2.0, 5}, {3, 5.0, 2}}));
  EXPECT_EQ(total_count(counts), 7.0);
  EXPECT_TRUE(share_a_site(counts, {{0, 1.0, 1}, {3, 1.0, 1}}));
  EXPECT_FALSE(share_a_site(counts, {{0, 1.0, 1}, {2, 1.0, 1}}));
  std::vector<Site> sites(4);
  sites[1].episodes = 9;
  sites[3].episodes = 20;
  EXPECT_EQ(age_episodes(counts, sites), 4);
}

}  // namespace
}  // namespace sila
