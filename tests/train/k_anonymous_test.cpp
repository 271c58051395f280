// What may be given away: support counts different tracks, never too many.
#include <gtest/gtest.h>

#include "sila/refine/prune.hpp"
#include "sila/train/episode.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

/// A pedestrian who walks where nobody else does.
FramedTrajectory lone_walk(unsigned seed) {
  return {testing::walk("lone" + std::to_string(seed), {{-12.0, -14.0}, {-13.0, -3.0}}, 1.3, 0.1, 0.02, seed),
          testing::square_frame()};
}

bool goes_alone(const Model& model) {
  const double cell = model.settings.grid.cell * model.settings.reference_width_m;
  return std::ranges::any_of(model.primitives, [&](const MotionPrimitive& primitive) {
    return std::ranges::any_of(primitive.cells, [&](const CellVelocity& entry) {
      return entry.cell.x * cell < -9.0 && entry.cell.y * cell < -4.0;
    });
  });
}

Model learnt(std::span<const FramedTrajectory> tracks, std::size_t batch) {
  return run_episodes({}, tracks, batch, kConfig, sila_update(kConfig)).model;
}

TEST(Support, IsTheNumberOfTracksInOneBatchAndTheirSumOverEpisodes) {
  std::vector<FramedTrajectory> same_way;
  for (unsigned i = 0; i < 6; ++i) same_way.push_back(lone_walk(i));
  for (const std::size_t batch : {1u, 2u, 6u}) {
    SCOPED_TRACE(batch);
    const Model model = learnt(same_way, batch);
    int most = 0;
    for (const Transition& edge : model.transitions) most = std::max(most, edge.support);
    EXPECT_LE(most, 6);
    EXPECT_GE(most, batch == 6u ? 6 : 4);  // a lower bound where fusing cannot tell
    for (const MotionPrimitive& primitive : model.primitives) EXPECT_LE(primitive.support, 6);
  }
}

TEST(Support, IsNeverMoreThanTheTracksNorMoreThanWhatWasCounted) {
  for (const unsigned seed : {3u, 4u}) {
    const std::vector<FramedTrajectory> tracks = testing::corner_walks(90, seed);
    const Model model = learnt(tracks, 10);
    EXPECT_FALSE(model.transitions.empty());
    for (const Transition& edge : model.transitions) {
      EXPECT_GE(edge.support, 1);
      EXPECT_LE(edge.support, edge.count + 1e-9);
      EXPECT_LE(edge.support, model.tracks);
    }
    for (const MotionPrimitive& primitive : model.primitives) EXPECT_LE(primitive.support, model.tracks);
  }
}

TEST(Support, OfOneTrackIsOneHoweverOftenItComesBack) {
  std::vector<Vector2> there_and_back;
  for (int round = 0; round < 3; ++round)
    there_and_back.insert(there_and_back.end(), {{12.0, 1.0}, {2.0, 1.0}, {2.0, 9.0}, {12.0, 9.0}});
  const std::vector<FramedTrajectory> track = {
      {testing::walk("t", there_and_back, 1.3, 0.1, 0.02), testing::square_frame()}};
  const Model model = learnt(track, 1);
  EXPECT_FALSE(model.empty());
  for (const Transition& edge : model.transitions) EXPECT_EQ(edge.support, 1);
  for (const MotionPrimitive& primitive : model.primitives) EXPECT_LE(primitive.support, 1);
  EXPECT_TRUE(k_anonymous(model, 2).empty());
}

TEST(Share, KeepsOutWhatFewerShowedUntilEnoughDid) {
  std::vector<FramedTrajectory> tracks = testing::corner_walks(60, 5);
  int alone_at_home = 0, alone_away = 0;
  for (unsigned people = 1; people <= 6; ++people) {
    SCOPED_TRACE(people);
    tracks.insert(tracks.begin() + 10 * people, lone_walk(people));
    const Model model = learnt(tracks, 10);
    const Model shared = k_anonymous(model, 4);
    EXPECT_NO_THROW(check(shared));
    EXPECT_GT(model.refinement.error_statistics.front().correction.weight, 0.0);
    EXPECT_EQ(shared.refinement.error_statistics.front().correction.weight, 0.0);
    EXPECT_EQ(shared.refinement.error_statistics.front().correction_share.weight, 0.0);
    alone_at_home += goes_alone(model);
    alone_away += goes_alone(shared);
    if (people < 4) {
      EXPECT_FALSE(goes_alone(shared));
    }
    EXPECT_FALSE(shared.empty());
    for (const MotionPrimitive& primitive : shared.primitives) EXPECT_GE(primitive.support, 4);
    for (const Transition& edge : shared.transitions) EXPECT_GE(edge.support, 4);
  }
  EXPECT_GT(alone_away, 0);
  EXPECT_GT(alone_at_home, alone_away);
}

TEST(Share, RejectsFewerThanOne) {
  EXPECT_THROW(k_anonymous({}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace sila
