#include "sila/train/fleet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>

#include "sila/model/packing.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

using testing::learnt;
using testing::partitions_of;

const EpisodeConfig kConfig;

using Tracks = std::vector<FramedTrajectory>;

Tracks part(const Tracks& tracks, std::size_t from, std::size_t count) {
  const auto first = tracks.begin() + static_cast<std::ptrdiff_t>(from);
  return {first, first + static_cast<std::ptrdiff_t>(count)};
}

TEST(EpisodeIds, StandForTheContentWhateverItsNamesAndOrder) {
  Tracks tracks = testing::corner_walks(6, 1);
  const EpisodeId id = episode_id(tracks);
  std::reverse(tracks.begin(), tracks.end());
  for (FramedTrajectory& track : tracks) track.track.id = "other";
  EXPECT_EQ(episode_id(tracks), id);
  EXPECT_EQ(episode_id_of(to_text(id)), id);
  EXPECT_EQ(to_text(id).size(), 32u);
}

TEST(EpisodeIds, DifferByABitOfATrackByItsCornerAndByATrackMore) {
  const Tracks tracks = testing::corner_walks(6, 2);
  const EpisodeId id = episode_id(tracks);
  Tracks other = tracks;
  other[3].track.positions_m[2].x() = std::nextafter(other[3].track.positions_m[2].x(), 1e9);
  EXPECT_NE(episode_id(other), id);
  other = tracks;
  other[3].frame.origin_m.y() += 1e-9;
  EXPECT_NE(episode_id(other), id);
  other = tracks;
  other.push_back(tracks.front());
  EXPECT_NE(episode_id(other), id);
  EXPECT_NE(episode_id(part(tracks, 0, 5)), id);
}

TEST(EpisodeIds, AreReadFromNothingElse) {
  for (const char* text : {"", "12", "0123456789abcdef0123456789abcdeg", "0123456789abcdef0123456789abcdef0"})
    EXPECT_THROW(episode_id_of(text), std::invalid_argument) << text;
}

TEST(Episode, ThatTheModelHasLearntBeforeChangesNothing) {
  const Tracks tracks = testing::corner_walks(60, 3);
  const auto learn = [&](const Model& start, const Tracks& some) {
    return run_episodes(start, some, 20, kConfig, sila_update(kConfig));
  };
  const Training whole = learn({}, tracks);
  EXPECT_EQ(whole.known, 0);
  EXPECT_EQ(whole.model.episode_ids.size(), 3u);
  const Training again = learn(whole.model, tracks);
  EXPECT_EQ(again.known, 3);
  EXPECT_TRUE(again.episodes.empty());
  EXPECT_TRUE(identical(again.model, whole.model));
  // A run that was killed after its second episode and is started anew.
  const Training killed = learn({}, part(tracks, 0, 40));
  const Training resumed = learn(killed.model, tracks);
  EXPECT_EQ(resumed.known, 2);
  EXPECT_TRUE(identical(resumed.model, whole.model));
}

TEST(FuseModels, DoesNotCountAnEpisodeTwice) {
  const Tracks tracks = testing::corner_walks(60, 4);
  const Model all = learnt(tracks);
  const Model last = learnt(part(tracks, 40, 20));
  EXPECT_THROW(fuse_models(all, last, kConfig.fuse), std::invalid_argument);
  const Model other = learnt(testing::corner_walks(20, 5));
  const Model fused = fuse_models(all, other, kConfig.fuse).model;
  EXPECT_EQ(fused.episode_ids.size(), 4u);
  EXPECT_TRUE(std::ranges::is_sorted(fused.episode_ids));
}

TEST(FuseModels, NeedsOneReferenceWidthAndSaysSo) {
  Tracks narrow = testing::corner_walks(20, 6), wide = testing::corner_walks(20, 7);
  for (FramedTrajectory& track : narrow) track.frame = testing::square_frame(2.5, CurbScaling::mean_width);
  for (FramedTrajectory& track : wide) track.frame = testing::square_frame(3.5, CurbScaling::mean_width);
  EpisodeConfig config = kConfig;
  config.scaling = CurbScaling::mean_width;
  const auto learnt = [&](const Tracks& tracks) { return run_episode({}, tracks, config).model; };
  EXPECT_TRUE(says(message_of([&] { fuse_models(learnt(narrow), learnt(wide), config.fuse); }), "reference_width_m"));
  config.reference_width_m = 3.0;
  const Model fused = fuse_models(learnt(narrow), learnt(wide), config.fuse).model;
  EXPECT_EQ(fused.settings.reference_width_m, 3.0);
  EXPECT_EQ(fused.tracks, 40);
  config.reference_width_m = 3.1;
  EXPECT_THROW(run_episode(fused, part(narrow, 0, 5), config), std::invalid_argument);
}

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

TEST(Fleet, IsTheSameInWhateverOrderItsPartitionsCome) {
  const Tracks tracks = testing::corner_walks(110, 9);
  std::vector<Partition> partitions = partitions_of(tracks, 20, 10);
  const Model model = learn_fleet({}, partitions, kConfig);
  EXPECT_EQ(model.tracks, 110);
  EXPECT_EQ(model.episodes, 11);
  EXPECT_EQ(model.episode_ids.size(), 11u);
  ASSERT_EQ(model.sites.size(), 1u);
  EXPECT_FALSE(model.refinement.error_statistics[0].empty());
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 3; ++trial) {
    std::shuffle(partitions.begin(), partitions.end(), random);
    EXPECT_TRUE(identical(learn_fleet({}, partitions, kConfig), model)) << "trial " << trial;
  }
}

TEST(Fleet, CorrectsPathsAsOneBatchAfterAnotherDoes) {
  const Model model = learn_fleet({}, partitions_of(testing::corner_walks(80, 5), 20, 20), kConfig);
  const ErrorStatistics& statistics = model.refinement.error_statistics.front();
  EXPECT_GT(statistics.correction_share.weight, 0.0);
  EXPECT_GT(statistics.motion_share.weight, 0.0);
}

TEST(Fleet, LearnsNothingTwice) {
  const Tracks tracks = testing::corner_walks(80, 10);
  std::vector<Partition> partitions = partitions_of(tracks, 40, 20);
  const Model model = learn_fleet({}, partitions, kConfig);
  EXPECT_TRUE(identical(learn_fleet(model, partitions, kConfig), model));
  partitions.push_back(partitions.front());
  EXPECT_TRUE(identical(learn_fleet({}, partitions, kConfig), model));
  // A partition of which one batch is known.
  Tracks mixed = part(tracks, 0, 20);
  const Tracks fresh = testing::corner_walks(20, 11);
  mixed.insert(mixed.end(), fresh.begin(), fresh.end());
  const Model more = learn_fleet(model, partitions_of(mixed, 40, 20), kConfig);
  EXPECT_TRUE(identical(more, learn_fleet(model, partitions_of(fresh, 40, 20), kConfig)));
  EXPECT_EQ(more.tracks, 100);
}

TEST(Fleet, TakesModelsThatWereLearntElsewhere) {
  const Tracks tracks = testing::corner_walks(60, 12);
  std::vector<Partition> partitions = partitions_of(part(tracks, 0, 40), 20, 20);
  Partition elsewhere;
  elsewhere.model = learnt(part(tracks, 40, 20));
  partitions.push_back(elsewhere);
  const Model model = learn_fleet({}, partitions, kConfig);
  EXPECT_EQ(model.tracks, 60);
  EXPECT_EQ(model.episode_ids.size(), 3u);
  const Model alone = learn_fleet({}, {elsewhere}, kConfig);
  EXPECT_TRUE(identical(alone, *elsewhere.model));
}

TEST(Fleet, BeginsWithTheMedianWidthOfItsPlaces) {
  EXPECT_EQ(agreed_width_m({4.0, 2.0, 3.0}), 3.0);
  EXPECT_EQ(agreed_width_m({4.0, 2.0}), 2.0);
  EXPECT_THROW(agreed_width_m({}), std::invalid_argument);
  std::vector<Partition> partitions;
  for (const double width_m : {3.5, 2.0, 2.5}) {
    partitions.push_back({testing::corner_walks(20, static_cast<unsigned>(10.0 * width_m)), 20, {}, {}});
    for (FramedTrajectory& track : partitions.back().tracks)
      track.frame = testing::square_frame(width_m, CurbScaling::mean_width);
  }
  EpisodeConfig by_width = kConfig;
  by_width.scaling = CurbScaling::mean_width;
  EXPECT_EQ(learn_fleet({}, partitions, by_width).settings.reference_width_m, 2.5);
}

TEST(Fleet, SpreadsThePartitionsOfEachSiteOverBothHalves) {
  std::vector<std::vector<EpisodeId>> episodes;
  std::vector<CurbFrame> sites;
  for (std::uint64_t i = 0; i < 12; ++i) {
    episodes.push_back({{i, 0}});
    sites.push_back(testing::square_frame());
    sites.back().origin_m.x() = i < 8 ? 0.0 : 100.0;
  }
  const std::vector<bool> are_models(12, false);
  const std::vector<ChosenPartition> chosen = choose_partitions(episodes, sites, are_models, {});
  ASSERT_EQ(chosen.size(), 12u);
  const auto of_second = [&](std::size_t from) {
    return std::count_if(chosen.begin() + static_cast<std::ptrdiff_t>(from),
                         chosen.begin() + static_cast<std::ptrdiff_t>(from) + 6,
                         [](const ChosenPartition& partition) { return partition.partition >= 8; });
  };
  EXPECT_EQ(of_second(0), 2);
  EXPECT_EQ(of_second(6), 2);
  EXPECT_THROW(choose_partitions(episodes, std::span(sites).first(3), are_models, {}), std::invalid_argument);
  EXPECT_THROW(choose_partitions(episodes, sites, {}, {}), std::invalid_argument);
}

TEST(Fleet, LeavesWhatAModelHasOutOfTheTracks) {
  for (const std::uint64_t first : {1U, 3U}) {  // in the order of content the model is the last or the first
    const std::vector<std::vector<EpisodeId>> episodes{{{2, 0}, {3, 0}}, {{first, 0}, {3, 0}}};
    const std::vector<CurbFrame> sites(2, testing::square_frame());
    for (const ChosenPartition& choice : choose_partitions(episodes, sites, {false, true}, {}))
      EXPECT_EQ(choice.left_out.empty(), choice.partition == 1) << first;
  }
}

TEST(Fleet, ScoresAPartitionByItselfIfTheOthersDoNotKnowItsSite) {
  const Tracks elsewhere = testing::walks_at(make_curb_frame({100, 0}, {1, 0}, {0, 1}, 2.5), 60, 13);
  const Partition here{testing::corner_walks(60, 12), 20, {}, {}}, there{elsewhere, 20, {}, {}};
  const Model model = learn_fleet({}, {here, there}, kConfig);
  ASSERT_EQ(model.sites.size(), 2u);
  for (const std::size_t site : {0U, 1U})
    EXPECT_GT(entry_of(model.refinement.error_statistics, site).density[kWalking].scale.weight, 100.0);  // windows
}

TEST(FleetPlan, ScoresNoModelOnTracksThatItHasLearnt) {
  for (const int partitions : {1, 2, 3, 7, 16, 33}) {
    for (const bool goes_on : {false, true}) {
      const std::vector<FleetTask> plan = plan_fleet(partitions, goes_on, kConfig);
      std::vector<std::set<int>> knows(plan.size());
      std::vector<int> fitted(static_cast<std::size_t>(partitions), 0);
      std::set<std::pair<FleetStep, std::vector<int>>> combined;
      for (std::size_t t = 0; t < plan.size(); ++t) {
        const FleetTask& task = plan[t];
        if (task.partition < 0) {
          EXPECT_TRUE(combined.insert({task.step, task.inputs}).second) << "two tasks do the same";
        }
        for (const int input : task.inputs) {
          ASSERT_LT(input, static_cast<int>(t)) << "a task needs a later one";
          if (input >= 0)
            knows[t].insert(knows[static_cast<std::size_t>(input)].begin(),
                            knows[static_cast<std::size_t>(input)].end());
        }
        if (task.step == FleetStep::learn) knows[t].insert(task.partition);
        if (task.step != FleetStep::calibrate && task.step != FleetStep::warm_up) continue;
        ++fitted[static_cast<std::size_t>(task.partition)];
        const int scored = task.inputs.front();
        if (scored >= 0) {
          const std::set<int>& known = knows[static_cast<std::size_t>(scored)];
          EXPECT_FALSE(known.contains(task.partition)) << partitions << " partitions";
          EXPECT_GE(static_cast<int>(known.size()), partitions - (partitions + 3) / 4) << "all but a quarter";
        }
      }
      for (const int rounds : fitted) EXPECT_EQ(rounds, kFleetRounds);
      EXPECT_EQ(knows.back().size(), static_cast<std::size_t>(partitions)) << "every partition counts";
    }
  }
  EXPECT_THROW(plan_fleet(0, false, kConfig), std::invalid_argument);
}

}  // namespace
}  // namespace sila
