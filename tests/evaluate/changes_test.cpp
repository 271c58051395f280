// How stated probabilities of a change of motion are scored.
#include <gtest/gtest.h>

#include <vector>

#include "sila/evaluate/metrics.hpp"

namespace sila {
namespace {

TEST(ScoreChanges, IsTheBrierScoreBesideThatOfTheRate) {
  const std::vector<ChangeForecast> forecasts = {{0.9, true}, {0.1, false}, {0.2, false}, {1.0, true}};
  const ChangeScore score = score_changes(1, 2.0, forecasts);
  EXPECT_EQ(score.windows, 4);
  EXPECT_DOUBLE_EQ(score.rate, 0.5);
  EXPECT_DOUBLE_EQ(score.base_brier, 0.25);
  EXPECT_NEAR(score.brier, (0.01 + 0.01 + 0.04) / 4.0, 1e-12);
  EXPECT_NEAR(score.calibration_error, (0.1 + 0.1 + 0.2) / 4.0, 1e-12);  // 0.9 and 1 share the last bin
}

TEST(ScoreChanges, CalibrationErrorIsNoneWhereRatesAgree) {
  std::vector<ChangeForecast> forecasts;
  for (int i = 0; i < 4; ++i) forecasts.push_back({0.25, i == 0});
  EXPECT_NEAR(score_changes(0, 1.0, forecasts).calibration_error, 0.0, 1e-12);
  EXPECT_NEAR(score_changes(0, 1.0, forecasts).brier, 0.25 * 0.75, 1e-12);
}

TEST(ScoreOutcomes, SumsTheBrierScoreOverOutcomes) {
  const std::vector<OutcomeForecast> forecasts = {{{0.8, 0.2, 0.0, 0.0, 0.0}, Outcome::stays},
                                                  {{0.5, 0.5, 0.0, 0.0, 0.0}, Outcome::straight}};
  const OutcomeScore score = score_outcomes(kStanding, 2.0, forecasts);
  EXPECT_EQ(score.windows, 2);
  EXPECT_EQ(score.rates, (OutcomeProbabilities{0.5, 0.5, 0.0, 0.0, 0.0}));
  EXPECT_DOUBLE_EQ(score.stated[0], 0.65);
  EXPECT_NEAR(score.brier, (0.04 + 0.04 + 0.25 + 0.25) / 2.0, 1e-12);
  EXPECT_DOUBLE_EQ(score.base_brier, 0.5);
  // Ten probabilities; in the bin of 0.5 one came and one did not.
  EXPECT_NEAR(score.calibration_error, (0.2 + 0.2) / 10.0, 1e-12);
}

TEST(ScoreOutcomes, CalibrationErrorIsNoneWhereRatesAgree) {
  std::vector<OutcomeForecast> forecasts;
  for (int i = 0; i < 4; ++i)
    forecasts.push_back({{0.75, 0.25, 0.0, 0.0, 0.0}, i == 0 ? Outcome::straight : Outcome::stays});
  EXPECT_NEAR(score_outcomes(kWalking, 1.0, forecasts).calibration_error, 0.0, 1e-12);
}

}  // namespace
}  // namespace sila
