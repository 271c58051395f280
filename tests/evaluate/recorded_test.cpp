#include <gtest/gtest.h>

#include "sila/core/errors.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/reports.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

RecordedPredictions recorded_in(const std::string& text) {
  const tests::ScratchFolder folder;
  return read_predictions(folder.write("recorded.ndjson", text));
}

/// Errors of recorded lines are those of the model that made them; coverage too, if the lines are in full.
void expect_scored_as_the_model(const LineFormat& format, double tolerance_m) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(30, 4);
  const EpisodeConfig config;
  const EvaluateConfig evaluate_config;
  const Model model = run_episode(Model{}, std::span(tracks).first(15), config).model;
  const std::span<const FramedTrajectory> unseen = std::span(tracks).subspan(15);
  std::string text = "{\"rejected\":\"late\",\"count\":3}\n";
  const Predictor predictor(model, config.predict);
  for (const Window& window : windows_of(unseen, config.sampling, config.predict, evaluate_config.stride_s))
    text += prediction_line(window.observed.id, predictor.predict(window.observed), nullptr, nullptr, format) + "\n";
  const RecordedPredictions recorded = recorded_in(text);
  const Evaluation direct = evaluate(model, unseen, config, evaluate_config);
  const Evaluation read = evaluate_forecast(forecast_of(recorded), unseen, config, evaluate_config);
  ASSERT_EQ(read.windows.size(), direct.windows.size());
  for (std::size_t w = 0; w < read.windows.size(); ++w) {
    EXPECT_EQ(read.windows[w].t0_s, direct.windows[w].t0_s);
    for (std::size_t h = 0; h < read.horizons_s.size(); ++h) {
      EXPECT_NEAR(read.windows[w].model[h].weighted_mhd_m, direct.windows[w].model[h].weighted_mhd_m, tolerance_m);
      if (format.digits == 17) {
        EXPECT_EQ(read.windows[w].model[h].coverage, direct.windows[w].model[h].coverage);
      }
    }
  }
  ASSERT_EQ(read.outcomes.size(), format.outcomes ? direct.outcomes.size() : 0);
  for (std::size_t s = 0; s < read.outcomes.size(); ++s)
    EXPECT_NEAR(read.outcomes[s].brier, direct.outcomes[s].brier, tolerance_m);
}

TEST(RecordedPredictions, InFullAreScoredAsTheModelThatMadeThem) {
  expect_scored_as_the_model({.digits = 17, .outcomes = true}, 1e-12);
}

TEST(RecordedPredictions, RoundedAreScoredAsTheModelToAMillimetre) {
  expect_scored_as_the_model({}, 1e-3);
}

TEST(RecordedPredictions, WindowsWithoutOneAreLeftOut) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(3, 4);
  const RecordedPredictions none_recorded;
  const Evaluation none = evaluate_forecast(forecast_of(none_recorded), tracks, EpisodeConfig{}, EvaluateConfig{});
  EXPECT_TRUE(none.windows.empty());
  EXPECT_EQ(none.groups.front().windows, 0u);
}

TEST(RecordedPredictions, OfOtherStepsAreRejected) {
  const auto score_steps_of = [](double interval_s) {
    const auto forecast = [&](const CurbTrajectory&) {
      const LinearReference reference = unfitted_reference(Reference::stays, 50, interval_s);
      return reference.predict(std::vector<Vector2>(2, Vector2::Zero()), interval_s);
    };
    evaluate_forecast(forecast, testing::corner_walks(3, 4), EpisodeConfig{}, EvaluateConfig{});
  };
  EXPECT_NO_THROW(score_steps_of(0.2));
  EXPECT_TRUE(says(message_of<std::invalid_argument>([&] { score_steps_of(0.1); }), "steps of 0.1 s"));
}

TEST(RecordedPredictions, ThoseWithoutASampleOfTheirTrackAreCounted) {
  FramedTrajectory placed;
  placed.track = {"17#2", {1.0, 2.0}, {Vector2(0.0, 0.0), Vector2(1.0, 0.0)}};
  const RecordedPredictions recorded{{{"17", 1.0}, {}}, {{"17#2", 2.0}, {}}, {{"17", 1.5}, {}}, {{"18", 1.0}, {}}};
  EXPECT_EQ(count_without_track(recorded, std::span(&placed, 1)), 2U);
}

TEST(RecordedPredictions, ALineThatIsNoneIsNamed) {
  EXPECT_TRUE(says(message_of<FormatError>([] { recorded_in("{\"count\":3}\n{\"modes\":[{}]}\n"); }), "ndjson:2: "));
}

}  // namespace
}  // namespace sila
