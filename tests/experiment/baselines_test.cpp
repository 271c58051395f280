#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sila/experiment/baselines/cliff.hpp"
#include "sila/experiment/baselines/memory.hpp"
#include "sila/experiment/course.hpp"
#include "sila/train/training.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;
constexpr int kSteps = 25;
constexpr double kInterval_s = 0.2;

CurbTrajectory seen(const FramedTrajectory& placed, double until_s) {
  std::size_t last = 0;
  while (last + 1 < placed.track.times_s.size() && placed.track.times_s[last] < until_s) ++last;
  return observe(placed.track, last, placed.frame, 3.2, kConfig.sampling);
}

FramedTrajectory straight(const std::string& id, double offset, const CurbFrame& frame = testing::square_frame()) {
  return {testing::walk(id, {{14.0, offset}, {-14.0, offset}}, 1.4), frame};
}

void expect_a_prediction(const Prediction& prediction, std::size_t modes) {
  ASSERT_EQ(prediction.modes.size(), modes);
  double sum = 0.0, heaviest = 1.0;
  for (const Mode& mode : prediction.modes) {
    ASSERT_EQ(mode.path_m.size(), static_cast<std::size_t>(kSteps));
    ASSERT_EQ(mode.covariances_m2.size(), static_cast<std::size_t>(kSteps));
    EXPECT_LE(mode.weight, heaviest + 1e-12);
    heaviest = mode.weight, sum += mode.weight;
    EXPECT_GT(mode.covariances_m2.back().determinant(), 0.0);
  }
  EXPECT_NEAR(sum, 1.0, 1e-9);
}

TEST(Memory, RecallsWhatWasSeenAsItHappened) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(30, 3);
  MemoryConfig nearest;
  nearest.neighbours = 1;
  const TrackMemory memory = remember({}, tracks, kConfig, nearest);
  const std::vector<Window> windows = windows_of(std::span(tracks).first(1), kConfig.sampling, kConfig.predict, 0.4);
  ASSERT_FALSE(windows.empty());
  const Prediction prediction = predict(memory, windows[0].observed, kSteps, kInterval_s, nearest);
  expect_a_prediction(prediction, 1);
  for (std::size_t j = 0; j < kSteps; ++j)
    EXPECT_LT((prediction.modes[0].path_m[j] - windows[0].future_m[j]).norm(), 1e-9);
}

TEST(Memory, KeepsEveryWindowWithAWholeFutureAndGrowsBatchByBatch) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 4);
  const MemoryConfig config;
  std::size_t whole = 0;
  for (const Window& window : windows_of(tracks, kConfig.sampling, kConfig.predict, config.every_s))
    whole += window.future_m.size() == static_cast<std::size_t>(kSteps) ? 1u : 0u;
  const TrackMemory at_once = remember({}, tracks, kConfig, config);
  TrackMemory parts = remember({}, std::span(tracks).first(10), kConfig, config);
  parts = remember(std::move(parts), std::span(tracks).subspan(10), kConfig, config);
  EXPECT_EQ(at_once.windows.size(), whole);
  EXPECT_EQ(parts.windows.size(), whole);
  const CurbTrajectory observed = seen(straight("new", 1.3), 5.0);
  const Prediction a = predict(at_once, observed, kSteps, kInterval_s, config);
  const Prediction b = predict(parts, observed, kSteps, kInterval_s, config);
  expect_a_prediction(a, 25);
  for (std::size_t m = 0; m < 25; ++m) EXPECT_EQ(a.modes[m].path_m.back(), b.modes[m].path_m.back());
}

TEST(Memory, KnowsNothingAtFirstAndSaysSo) {
  const Prediction prediction = predict(TrackMemory{}, seen(straight("a", 1.0), 5.0), kSteps, kInterval_s, {});
  expect_a_prediction(prediction, 1);
  EXPECT_TRUE(prediction.fallback);
}

TEST(Memory, ServesAnotherPlaceByItsCurbFrame) {
  const TrackMemory memory = remember({}, testing::corner_walks(40, 5), kConfig, {});
  CurbFrame turned = make_curb_frame({50, 20}, {0, 1}, {-1, 0}, {2.5, 2.5, 2.5}, CurbScaling::metres);
  const FramedTrajectory here = straight("a", 1.0);
  FramedTrajectory there = here;
  there.frame = turned;
  for (Vector2& p : there.track.positions_m) p = to_world(turned, to_curb(here.frame, p));
  const Prediction a = predict(memory, seen(here, 5.0), kSteps, kInterval_s, {});
  const Prediction b = predict(memory, seen(there, 5.0), kSteps, kInterval_s, {});
  for (std::size_t j = 0; j < kSteps; ++j) {
    const Vector2 moved = to_world(turned, to_curb(here.frame, a.modes[0].path_m[j]));
    EXPECT_LT((moved - b.modes[0].path_m[j]).norm(), 1e-6);
  }
}

TEST(SemiWrapped, FindsTwoStreamsOneOfThemAcrossTheCut) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Vector2> samples;
  for (int i = 0; i < 300; ++i) {
    const bool west = i % 3 == 0;
    const double direction = (west ? std::numbers::pi : 0.0) + 0.15 * normal(random);
    samples.emplace_back(wrapped_rad(direction), (west ? 0.8 : 1.5) + 0.1 * normal(random));
  }
  std::vector<SemiWrappedGaussian> mixture = fit_semi_wrapped(samples);
  ASSERT_EQ(mixture.size(), 2u);
  if (mixture[0].weight < mixture[1].weight) std::swap(mixture[0], mixture[1]);
  EXPECT_NEAR(mixture[0].weight, 2.0 / 3.0, 0.01);
  EXPECT_NEAR(mixture[0].mean.x(), 0.0, 0.05);
  EXPECT_NEAR(mixture[0].mean.y(), 1.5, 0.05);
  EXPECT_NEAR(std::abs(wrapped_rad(mixture[1].mean.x() - std::numbers::pi)), 0.0, 0.05);
  EXPECT_NEAR(mixture[1].mean.y(), 0.8, 0.05);
}

TEST(SemiWrapped, IsADensityOverTheCircle) {
  const std::vector<Vector2> samples{{3.0, 1.0}, {-3.0, 1.1}, {3.1, 0.9}, {0.2, 1.4}, {0.1, 1.5}};
  const std::vector<SemiWrappedGaussian> mixture = fit_semi_wrapped(samples);
  double sum = 0.0;
  constexpr int kCells = 600;
  const double wide = 2.0 * std::numbers::pi / kCells, high = 5.0 / kCells;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const Vector2 middle(-std::numbers::pi + (i + 0.5) * wide, -1.0 + (j + 0.5) * high);
      sum += density(mixture, middle) * wide * high;
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-3);
}

TEST(Cliff, FollowsAStreamRoundACornerWhereConstantVelocityGoesOn) {
  std::vector<FramedTrajectory> tracks;
  for (int i = 0; i < 20; ++i) {
    const double offset = 0.8 + 0.05 * i;
    tracks.push_back({testing::walk("t" + std::to_string(i), {{14.0, offset}, {offset, offset}, {offset, 14.0}}, 1.4),
                      testing::square_frame()});
  }
  CliffConfig config;
  config.beta = 0.1;
  const CliffMap map = map_dynamics({}, tracks, kConfig, config);
  EXPECT_GT(size(map), 10u);
  const CurbTrajectory observed = seen(tracks[10], 8.0);  // about 3 m before the corner
  const Prediction prediction = predict(map, observed, kSteps, kInterval_s, config);
  expect_a_prediction(prediction, 20);
  Vector2 mean = Vector2::Zero();
  for (const Mode& mode : prediction.modes) mean += mode.weight * mode.path_m.back();
  EXPECT_GT(mean.y(), 2.5);   // constant velocity stays at 1.3
  EXPECT_GT(mean.x(), -2.0);  // and goes on to -4
}

TEST(Cliff, DrawsTheSamePathsForTheSameSeedAndOthersForAnother) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(30, 9);
  CliffConfig config;
  const CliffMap map = map_dynamics({}, tracks, kConfig, config);
  const CurbTrajectory observed = seen(straight("new", 1.3), 5.0);
  const Prediction a = predict(map, observed, kSteps, kInterval_s, config);
  const Prediction b = predict(map, observed, kSteps, kInterval_s, config);
  config.seed = 2;
  const Prediction c = predict(map, observed, kSteps, kInterval_s, config);
  EXPECT_EQ(a.modes[3].path_m.back(), b.modes[3].path_m.back());
  EXPECT_NE(a.modes[3].path_m.back(), c.modes[3].path_m.back());
}

TEST(CoveredArea, HasTheCellsOfTheTracksAndTheirNeighbours) {
  const std::vector<FramedTrajectory> tracks{straight("a", 1.5)};
  const CoveredArea area = covered_area(tracks);
  EXPECT_TRUE(contains(area, {0.0, 1.5}));
  EXPECT_TRUE(contains(area, {0.0, 2.9}));
  EXPECT_FALSE(contains(area, {0.0, 3.1}));
  EXPECT_TRUE(contains(area, {0.0, 0.1}));
  EXPECT_FALSE(contains(area, {0.0, -0.1}));
  EXPECT_THROW(covered_area(tracks, 0.0), std::invalid_argument);
}

TEST(EvaluateForecast, JudgesConstantVelocityAsConstantVelocityAndPartsInsideFromOutside) {
  const std::vector<FramedTrajectory> train = testing::corner_walks(40, 14), test = testing::corner_walks(20, 15);
  const Background background = background_of(train, kConfig, {});
  std::map<std::pair<std::string, double>, Prediction> constant;
  for (const Window& window : windows_of(test, kConfig.sampling, kConfig.predict, EvaluateConfig{}.every_s))
    constant[{window.observed.id, window.observed.times_s.back()}] =
        background.moving.front().predict(window.past_m, kInterval_s);
  const Forecast forecast = [&](const CurbTrajectory& observed) {
    return constant.at({observed.id, observed.times_s.back()});
  };
  const Evaluation evaluation = evaluate_forecast(forecast, test, kConfig, {}, &background);
  ASSERT_EQ(evaluation.groups.size(), 6u);
  EXPECT_EQ(evaluation.groups[1].windows + evaluation.groups[2].windows, evaluation.groups[0].windows);
  EXPECT_EQ(evaluation.groups[4].name, "inside");
  EXPECT_EQ(evaluation.groups[4].windows + evaluation.groups[5].windows, evaluation.groups[1].windows);
  EXPECT_GT(evaluation.groups[5].windows, 0u);
  for (const WindowScore& window : evaluation.windows)
    EXPECT_EQ(window.model.back().weighted_mhd_m, window.constant.back().weighted_mhd_m);
}

TEST(Course, EveryMethodLearnsAndIsJudged) {
  const std::vector<FramedTrajectory> train = testing::corner_walks(40, 16), test = testing::corner_walks(15, 17);
  Course course{{train}, {{"corner", test, background_of(train, kConfig, {}), {}}}, 20, true};
  for (std::size_t k = 0; k < std::size(kMethodKinds); ++k) {
    SCOPED_TRACE(kMethodKinds[k]);
    const std::vector<Milestone> milestones =
        run_course(course, {kMethodKinds[k], static_cast<MethodKind>(k), kConfig, {}, {}, {}});
    const bool at_once = kMethodKinds[k] == std::string("batch") || kMethodKinds[k] == std::string("tree");
    ASSERT_EQ(milestones.size(), at_once ? 1u : 2u);
    EXPECT_EQ(milestones.back().tracks, 40u);
    for (const Milestone& milestone : milestones) {
      ASSERT_EQ(milestone.places.size(), 1u);
      EXPECT_GT(milestone.places[0].evaluation.groups[1].windows, 20u);
    }
    EXPECT_EQ(milestones.back().size == 0, static_cast<MethodKind>(k) == MethodKind::kinematics);
  }
}

TEST(Course, IsTheLoopOfRunEpisodes) {
  const std::vector<FramedTrajectory> train = testing::corner_walks(60, 18), test = testing::corner_walks(15, 19);
  const Course course{{train}, {{"corner", test, background_of(train, kConfig, {}), {}}}, 20, false};
  const std::vector<Milestone> milestones = run_course(course, {"sila", MethodKind::sila, kConfig, {}, {}, {}});
  const Training run = run_episodes({}, train, 20, kConfig, sila_update(kConfig));
  EXPECT_EQ(milestones.back().size, size(run.model));
  EXPECT_TRUE(milestones[0].places.empty());
  EXPECT_EQ(milestones.back().places[0].evaluation.groups[1].model.back().weighted_mhd_m,
            evaluate(run.model, test, kConfig, {}).groups[1].model.back().weighted_mhd_m);
  EXPECT_THROW(run_course({}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
