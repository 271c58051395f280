#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "sila/io/reports.hpp"
#include "sila/train/episode.hpp"
#include "support/walks.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

/// Cells and directions as the file has them.
using Shape = std::vector<int>;
using Edges = std::map<std::pair<int, int>, double>;

struct Replayed {
  std::vector<Shape> primitives;
  Edges transitions;
};

/// What the viewer does, by another road: one episode further from nothing but the JSON.
Replayed replayed_after(const Replayed& before, const nlohmann::ordered_json& change) {
  Replayed after;
  std::set<int> gone = change.at("gone").get<std::set<int>>();
  std::vector<int> place;
  for (int i = 0; i < static_cast<int>(before.primitives.size()); ++i) {
    place.push_back(gone.contains(i) ? -1 : static_cast<int>(after.primitives.size()));
    if (!gone.contains(i)) after.primitives.push_back(before.primitives[static_cast<std::size_t>(i)]);
  }
  for (const auto& cells : change.at("added")) after.primitives.push_back(cells);
  for (const auto& fused : change.at("fused"))
    after.primitives.at(fused.at("primitive").get<std::size_t>()) = fused.at("cells").get<Shape>();
  for (const auto& [edge, count] : before.transitions) {
    const int from = place[static_cast<std::size_t>(edge.first)], to = place[static_cast<std::size_t>(edge.second)];
    if (from >= 0 && to >= 0) after.transitions[{from, to}] = count;
  }
  for (const auto& edge : change.at("transitions_gone")) after.transitions.erase({edge[0], edge[1]});
  for (const auto& edge : change.at("transitions")) after.transitions[{edge[0], edge[1]}] = edge[2];
  return after;
}

Edges edges_of(const Model& model) {
  Edges edges;
  for (const Transition& transition : model.transitions) edges[{transition.from, transition.to}] = transition.count;
  return edges;
}

std::vector<std::set<std::pair<int, int>>> cells_of(const Model& model) {
  std::vector<std::set<std::pair<int, int>>> list;
  for (const MotionPrimitive& primitive : model.primitives) {
    list.emplace_back();
    for (const CellVelocity& entry : primitive.cells) list.back().insert({entry.cell.x, entry.cell.y});
  }
  return list;
}

std::vector<std::set<std::pair<int, int>>> cells_of(const Replayed& replayed) {
  std::vector<std::set<std::pair<int, int>>> list;
  for (const Shape& shape : replayed.primitives) {
    list.emplace_back();
    for (std::size_t i = 0; i + 2 < shape.size(); i += 3) list.back().insert({shape[i], shape[i + 1]});
  }
  return list;
}

/// Tells every episode of a run from the changes alone and compares it with the model; how many were fused.
int fused_as_recorded(const Update& update, unsigned seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  Replayed replayed;
  Model previous;
  int fused = 0;
  run_episodes({}, testing::corner_walks(120, seed), 20, kConfig, update,
               [&](int number, const Model&, const Episode& episode) {
                 SCOPED_TRACE("episode " + std::to_string(number));
                 const ModelChange& change = episode.report.change;
                 EXPECT_EQ(change.primitives_after, static_cast<int>(episode.model.primitives.size()));
                 fused += static_cast<int>(change.fused.size());
                 replayed = replayed_after(replayed, to_json(change, previous, episode.model));
                 EXPECT_EQ(cells_of(replayed), cells_of(episode.model));
                 EXPECT_EQ(replayed.transitions, edges_of(episode.model));
                 for (const PrimitiveSplit& split : change.split) {
                   EXPECT_LT(split.primitive, change.primitives_before);
                   EXPECT_LT(split.first, change.primitives_after);
                   EXPECT_NE(split.first, split.second);
                 }
                 previous = episode.model;
               });
  return fused;
}

TEST(Change, TellsEveryEpisodeOfSila) {
  for (unsigned seed : {1u, 2u, 3u}) EXPECT_GT(fused_as_recorded(sila_update(kConfig), seed), 0);
}

TEST(Change, TellsEveryEpisodeOfTheBaselines) {
  EXPECT_EQ(fused_as_recorded(accumulate_update(kConfig), 4), 0);
  EXPECT_EQ(fused_as_recorded(retrain_update(kConfig), 5), 0);
}

TEST(Change, OfOneFusionAndOneSplitIsWhatThePlanSays) {
  Model previous, updated;
  previous.primitives.resize(3);
  updated.primitives.resize(3);
  FusionPlan plan;  // 0 takes up incoming 3; 1 is split into 2 and the incoming 4, which is new
  plan.in = {0, 2, 2, 0, 4};
  plan.out = {0, 4, 2, 0, 4};
  plan.fusion_set = {{0, 3}};
  plan.splits = {{1, 2, 4}};
  plan.kept = {0, 2, 4};
  const ModelChange change = change_by(plan, previous, updated);
  EXPECT_EQ(change.gone, std::vector<int>{1});
  EXPECT_EQ(change.added, std::vector<int>{2});
  ASSERT_EQ(change.fused.size(), 1u);
  EXPECT_EQ(change.fused[0].primitive, 0);
  EXPECT_EQ(change.fused[0].previous, std::vector<int>{0});
  EXPECT_EQ(change.fused[0].incoming, 1);
  ASSERT_EQ(change.split.size(), 1u);
  EXPECT_EQ(change.split[0].primitive, 1);
  EXPECT_EQ(change.split[0].first, 1);
  EXPECT_EQ(change.split[0].second, 2);
}

TEST(Change, RejectsAPlanOfOtherModels) {
  Model two;
  two.primitives.resize(2);
  EXPECT_THROW(change_by(FusionPlan{}, two, two), std::invalid_argument);
}

}  // namespace
}  // namespace sila
