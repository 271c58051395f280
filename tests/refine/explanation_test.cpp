#include <gtest/gtest.h>

#include <cmath>

#include "gp/posterior.hpp"
#include "predict/flow_field_index.hpp"
#include "refine/residual.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

using testing::corner_model;

const EpisodeConfig kConfig;

std::vector<Window> fresh_windows() {
  return windows_of(testing::corner_walks(20, 99), kConfig.sampling, kConfig.predict, 1.0);
}

TEST(Explanation, TermsGiveTheWeights) {
  const Predictor predictor(corner_model(), kConfig.predict);
  int compared = 0;
  for (const Window& window : fresh_windows()) {
    const Explanation explanation = explain(predictor, window.observed);
    std::vector<double> logs, weights;
    for (const ModeExplanation& mode : explanation.modes) {
      if (mode.variant != VariantKind::expected) continue;
      for (const RolloutExplanation& rollout : mode.rollouts) {
        logs.push_back(explanation.likelihood_power * rollout.log_likelihood + rollout.log_prior +
                       std::log(rollout.chain_probability));
        weights.push_back(rollout.weight);
        EXPECT_FALSE(rollout.transitions.empty());
        for (const TransitionCount& use : rollout.transitions) EXPECT_GT(use.count, 0.0);
      }
    }
    for (std::size_t i = 1; i < logs.size(); ++i, ++compared) {
      EXPECT_NEAR(std::log(weights[i] / weights[0]), logs[i] - logs[0], 1e-9);
    }
    double sum = 0.0;
    for (double weight : weights) sum += weight;
    if (!weights.empty()) {
      EXPECT_NEAR(sum, 1.0, 1e-12);
    }
  }
  EXPECT_GT(compared, 20);
}

TEST(Explanation, NoveltyCountsThoseWhoWereAtLeastAsSurprising) {
  const Predictor predictor(corner_model(), kConfig.predict);
  const Window window = fresh_windows().front();
  const Explanation explanation = explain(predictor, window.observed);
  EXPECT_NEAR(explanation.at_least_as_novel + predictor.predict(window.observed).novelty, 1.0, 1e-12);
  EXPECT_GT(explanation.effective_samples, 0.0);
}

TEST(Residuals, OfASingleExpertIsWhatTheExpertSays) {
  Model model = corner_model();
  for (std::size_t i = 1; i < model.transitions.size(); ++i) model.refinement.residuals[i] = {};
  const SparseGp& only = model.refinement.residuals.front();
  ASSERT_GT(only.points, 0.0);
  const FlowFieldIndex fields(model, {});
  const ResidualIndex index(model, {});
  for (const Window& window : fresh_windows()) {
    Scratch scratch;
    const auto experts = predict_experts(
        index, fields.near(window.observed, fields.site(window.observed.frame), scratch), window.observed, scratch);
    const ResidualPrediction residual_prediction = combine(index, window.observed, experts, {}, scratch);
    if (!(residual_prediction.effective_samples > 0.0)) continue;
    const ResidualInput input = residual_input(window.observed);
    Eigen::VectorXd mean(only.mean.size());
    Posterior(only).predict(std::span(input.data(), kResidualInputs),
                            std::span(mean.data(), static_cast<std::size_t>(mean.size())));
    const Vector2 last = velocity_to_world(window.observed.frame, mean.tail<2>());
    const std::span<const double> residuals_mps = residual_prediction.residuals_mps;
    const Vector2 at_first = Vector2::Map(residuals_mps.data()), at_last = Vector2::Map(residuals_mps.last(2).data());
    EXPECT_LT((at_last - last).norm(), 1e-9);
    EXPECT_EQ(residual_prediction.residual_mps(99.0), at_last);
    EXPECT_EQ(residual_prediction.residual_mps(0.1), at_first);
    return;
  }
  FAIL() << "no window came near the transition";
}

TEST(Predictor, AtAnUnknownCornerSaysTheSameWhereverItIsAndHoweverItIsTurned) {
  const Predictor predictor(corner_model(), kConfig.predict);
  const auto last_m = [&](const CurbFrame& frame, const std::vector<Vector2>& way) {
    const CurbTrajectory observed = observe(testing::walk("x", way, 1.3), 40, frame, 3.2, {});
    const Prediction prediction = predictor.predict(observed);
    EXPECT_TRUE(prediction.fallback);
    return Vector2(prediction.modes.front().path_m.back() - to_world(frame, observed.positions.back()));
  };
  CurbFrame here = testing::square_frame(), there = here;
  here.origin_m = {500, 0};
  there.origin_m = {-900, 40};
  const Vector2 east = last_m(here, {{500, 1}, {530, 1}}), north = last_m(there, {{-890, 30}, {-890, 70}});
  EXPECT_NEAR(east.x(), north.y(), 1e-6);
  EXPECT_NEAR(east.y(), -north.x(), 1e-6);
}

struct Coverage {
  double windows = 0.0, inside_50 = 0.0, inside_90 = 0.0;
};

/// Adds the windows of tracks that a model has not learnt, at 3 s.
void add_coverage(Coverage& coverage, const Model& model, const std::vector<FramedTrajectory>& tracks) {
  const Predictor predictor(model, kConfig.predict);
  for (const Window& window : windows_of(tracks, kConfig.sampling, kConfig.predict, 1.6)) {
    if (window.future_m.size() < 15) continue;
    const Prediction prediction = predictor.predict(window.observed);
    ASSERT_EQ(prediction.regions.size(), kRegionProbabilities.size());
    const double score = nonconformity(prediction, 14, window.future_m[14]);
    coverage.windows += 1.0;
    coverage.inside_50 += score <= prediction.regions[1].levels[14] ? 1.0 : 0.0;
    coverage.inside_90 += score <= prediction.regions[3].levels[14] ? 1.0 : 0.0;
  }
}

TEST(Predictor, StatedRegionsHoldWhatTheySayOnTracksThatWereNotLearnt) {
  const Model model = testing::learnt(testing::corner_walks(200, 31));
  Coverage found;
  add_coverage(found, model, testing::corner_walks(150, 77));
  ASSERT_GT(found.windows, 300.0);
  // Windows of a track are alike, so the standard error is that of some 150 people: 0.04 and 0.025; and the model is
  // still getting better, so that yesterday's errors are a little larger than today's.
  EXPECT_NEAR(found.inside_50 / found.windows, 0.5, 0.12);
  EXPECT_NEAR(found.inside_90 / found.windows, 0.9, 0.075);
}

TEST(Predictor, RegionsOfAYoungModelHoldNearlyWhatTheySay) {
  Coverage found;
  for (unsigned draw = 0; draw < 5; ++draw)
    add_coverage(found, run_episode({}, testing::corner_walks(5, 50 + draw), kConfig).model,
                 testing::corner_walks(40, 77));
  EXPECT_NEAR(found.inside_50 / found.windows, 0.5, 0.2);
  EXPECT_NEAR(found.inside_90 / found.windows, 0.9, 0.08);
}

TEST(Fuse, ResidualsKeepEveryExample) {
  const Model one = run_episode({}, testing::corner_walks(20, 41), kConfig).model;
  const Episode two = run_episode(one, testing::corner_walks(20, 42), kConfig);
  const Model alone = run_episode({}, testing::corner_walks(20, 42), kConfig).model;
  const auto points = [](const Model& model) {
    double sum = 0.0;
    for (const SparseGp& residual : model.refinement.residuals) sum += residual.points;
    return sum;
  };
  EXPECT_GT(points(alone), 0.0);
  // A split primitive hands its transitions to both parts, so examples may be known twice, never lost.
  EXPECT_GE(points(two.model), points(one) + points(alone) - 1e-9);
}

}  // namespace
}  // namespace sila
