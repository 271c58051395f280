#include <gtest/gtest.h>

#include "sila/evaluate/evaluate.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

TEST(CoveredArea, HasTheCellsOfTheTracksAndTheirNeighbours) {
  const std::vector<FramedTrajectory> tracks{
      {testing::walk("a", {{14.0, 1.5}, {-14.0, 1.5}}, 1.4), testing::square_frame()}};
  const CoveredArea area = covered_area(tracks);
  EXPECT_TRUE(contains(area, {0.0, 1.5}));
  EXPECT_TRUE(contains(area, {0.0, 2.9}));
  EXPECT_FALSE(contains(area, {0.0, 3.1}));
  EXPECT_TRUE(contains(area, {0.0, 0.1}));
  EXPECT_FALSE(contains(area, {0.0, -0.1}));
}

/// The mean NLL of constant velocity over the standing windows.
double standing_nll(const std::vector<FramedTrajectory>& tracks) {
  const EpisodeConfig config;
  const Evaluation evaluation = evaluate(Model{}, tracks, config, {});
  const auto group = std::ranges::find(evaluation.groups, "standing", &GroupScore::name);
  EXPECT_GT(group->windows, 0u);
  return group->constant.back().nll;
}

TEST(Evaluate, FitsConstantVelocityToStandingAndMovingPeopleApart) {
  std::vector<FramedTrajectory> tracks;
  for (int i = 0; i < 5; ++i) {
    const auto position_at = [&](int k) {
      return Vector2(3.0 * i + 0.01 * std::sin(0.3 * k + i), 8.0 + 0.01 * std::cos(0.4 * k));
    };
    tracks.push_back({testing::sampled(150, 0.1, position_at, "s" + std::to_string(i)), testing::square_frame()});
  }
  const double alone = standing_nll(tracks);
  std::ranges::move(testing::corner_walks(20, 15), std::back_inserter(tracks));
  EXPECT_NEAR(standing_nll(tracks), alone, 1e-9);
}

TEST(EvaluateForecast, ScoresConstantVelocityAsItselfAndPartsInsideFromOutside) {
  const EpisodeConfig config;
  const std::vector<FramedTrajectory> train = testing::corner_walks(40, 14), test = testing::corner_walks(20, 15);
  const TrainingSupport support = training_support(train, config, {});
  std::map<std::pair<std::string, double>, Prediction> constant;
  for (const Window& window : windows_of(test, config.sampling, config.predict, EvaluateConfig{}.stride_s))
    constant[{window.observed.id, window.observed.times_s.back()}] =
        support.references[1].front().predict(window.past_m, config.sampling.interval_s);
  const Forecast forecast = [&](const CurbTrajectory& observed) {
    return constant.at({observed.id, observed.times_s.back()});
  };
  const Evaluation evaluation = evaluate_forecast(forecast, test, config, {}, &support);
  ASSERT_EQ(evaluation.groups.size(), 6u);
  EXPECT_EQ(evaluation.groups[1].windows + evaluation.groups[2].windows, evaluation.groups[0].windows);
  EXPECT_EQ(evaluation.groups[4].name, "inside");
  EXPECT_EQ(evaluation.groups[4].windows + evaluation.groups[5].windows, evaluation.groups[1].windows);
  EXPECT_GT(evaluation.groups[5].windows, 0u);
  for (const WindowScore& window : evaluation.windows)
    EXPECT_EQ(window.model.back().weighted_mhd_m, window.constant.back().weighted_mhd_m);
}

}  // namespace
}  // namespace sila
