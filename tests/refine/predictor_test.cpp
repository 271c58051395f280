#include "sila/refine/predictor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/kinematics.hpp"
#include "predict/flow_field_index.hpp"
#include "predict/rollout.hpp"
#include "sila/config.hpp"
#include "sila/core/errors.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "support/sound.hpp"

namespace sila {
namespace {

using testing::corner_model;
using testing::expect_sound;

const EpisodeConfig kConfig;

TEST(Predictor, GivesSoundPredictionsOfAtMostTheModesAskedFor) {
  const auto windows = windows_of(testing::corner_walks(10, 99), kConfig.sampling, kConfig.predict, 1.0);
  ASSERT_FALSE(windows.empty());
  for (const int most : {1, 2, 3, 4, 8}) {
    for (const int variants : {0, 5}) {
      RefineConfig config = kConfig.predict;
      config.max_modes = most;
      config.mode_variants = variants;
      const Predictor predictor(corner_model(), config);
      for (const Window& window : windows) {
        const Prediction prediction = predictor.predict(window.observed);
        expect_sound(prediction);
        EXPECT_LE(prediction.modes.size(), static_cast<std::size_t>(most)) << variants;
        for (const Mode& mode : prediction.modes) {
          const auto same = [&](const Mode& other) {
            return other.variant != VariantKind::wide && other.path_m == mode.path_m;
          };
          EXPECT_EQ(std::ranges::count_if(prediction.modes, same), 1);
        }
      }
    }
  }
}

TEST(Predictor, PredictsATrackFromTheLeastObservedTimeOn) {
  const Predictor predictor(corner_model(), kConfig.predict);
  const Trajectory track = testing::walk("new", {{1, 1}, {12, 1}}, 1.3);
  const std::vector<std::size_t> due = prediction_samples(track, kConfig.predict.min_observe_s, 0.1);
  ASSERT_EQ(due.at(0), 4U);  // 0.4 s
  for (const std::size_t last : due) {
    const CurbTrajectory observed = observe(track, last, testing::square_frame(), 3.2, {});
    const Prediction prediction = predictor.predict(observed);
    expect_sound(prediction);
    EXPECT_EQ(prediction.regions.size(), kRegionProbabilities.size());
    const double error_m =
        (prediction.modes.front().path_m[4] - to_world(observed.frame, observed.positions.back()) - Vector2(1.3, 0.0))
            .norm();
    EXPECT_LT(error_m, 0.6);  // one second ahead
    if (track.times_s[last] > 6.0) break;
  }
}

TEST(Predictor, RejectsWindowsLongerThanThoseOfItsModel) {
  RefineConfig config = kConfig.predict;
  config.observe_s = 5.0;
  EXPECT_THROW(Predictor(corner_model(), config), std::invalid_argument);
  config.observe_s = 0.8;  // of less the same model says what it knows
  EXPECT_NO_THROW(Predictor(corner_model(), config));
}

TEST(Predictor, RejectsAModelWithAnIndefiniteMatrix) {
  Model model = corner_model();
  Eigen::MatrixXd& information = model.transitions.at(0).field.gp.information;
  information(0, 1) = information(1, 0) = 1e6 + information(0, 0) + information(1, 1);
  EXPECT_THROW(Predictor(model, kConfig.predict), NumericalError);
}

/// Where constant velocity of the smoothed path leads.
Vector2 constant_velocity_m(const CurbTrajectory& observed, double seconds) {
  return to_world(observed.frame, observed.positions.back()) +
         seconds * mean_velocity_mps(observed, kConstantVelocityWindow_s);
}

/// People who walk along curb 1 for 4 to 6 s and then stand for 9 s.
std::vector<FramedTrajectory> people_who_stop(int count) {
  std::vector<FramedTrajectory> tracks;
  for (int i = 0; i < count; ++i) {
    const auto number = static_cast<unsigned>(i);
    const double length_m = 4.8 + 2.4 * i / count;
    FramedTrajectory stops{
        testing::walk("s" + std::to_string(i), {{9.0, 1.0}, {9.0 - length_m, 1.0}}, 1.2, 0.1, 0.01, number),
        testing::square_frame()};
    const Trajectory stands =
        testing::walk("", {{9.0 - length_m, 1.0}, {9.0 - length_m, 1.009}}, 0.001, 0.1, 0.01, number);
    for (const Vector2& position_m : stands.positions_m) {
      stops.track.times_s.push_back(stops.track.times_s.back() + 0.1);
      stops.track.positions_m.push_back(position_m);
    }
    stops.track.recording = number;
    tracks.push_back(std::move(stops));
  }
  return tracks;
}

TEST(Predictor, APersonWhoHasJustStoppedStaysWhereOthersStayed) {
  const Predictor predictor(testing::learnt(people_who_stop(60)), kConfig.predict);
  const Trajectory track = people_who_stop(61).back().track;
  std::size_t stop = 0;
  while ((track.positions_m[stop] - track.positions_m.back()).norm() > 0.1) ++stop;
  const Prediction prediction =
      predictor.predict(observe(track, stop + 12, testing::square_frame(), 3.2, kConfig.sampling));
  const std::vector<Vector2> path_m = mean_path(prediction, prediction.times_s.size());
  EXPECT_LT((path_m.back() - track.positions_m.back()).norm(), 0.1);
  EXPECT_LT(std::sqrt(prediction.modes[0].covariances_m2.back().trace()), 0.1);
}

TEST(Predictor, FallsBackToKinematicsWhereNoTransitionIsNear) {
  const Trajectory far = testing::walk("far", {{500, 500}, {520, 500}}, 1.4);
  const CurbTrajectory observed = observe(far, 60, testing::square_frame(), 3.2, {});
  const Prediction prediction = Predictor(corner_model(), kConfig.predict).predict(observed);
  expect_sound(prediction);
  EXPECT_TRUE(prediction.fallback);
  EXPECT_GT(prediction.novelty, 0.99);
  RefineConfig plain = kConfig.predict;
  plain.stacking = false;
  const Prediction constant = Predictor(corner_model(), plain).predict(observed);
  for (std::size_t j = 0; j < 25; ++j)
    EXPECT_LT((constant.modes[0].path_m[j] - constant_velocity_m(observed, constant.times_s[j])).norm(), 1e-9);
}

/// Mean distance [m] between where the modes on average end and where people were.
double mean_miss_m(const Model& model, std::span<const Window> windows, const RefineConfig& config = kConfig.predict) {
  const Predictor predictor(model, config);
  double sum = 0.0;
  int count = 0;
  for (const Window& window : windows) {
    if (window.future_m.size() < 25) continue;
    const Prediction prediction = predictor.predict(window.observed);
    expect_sound(prediction);
    Vector2 end = Vector2::Zero();
    for (const Mode& mode : prediction.modes) end += mode.weight * mode.path_m[24];
    sum += (end - window.future_m[24]).norm();
    ++count;
  }
  return sum / count;
}

TEST(Predictor, WhereVeryManyTransitionsOverlapTheLeastLikelyAreNotMissed) {
  const std::vector<FramedTrajectory> walks = testing::corner_walks(400, 21);
  const Model crowded = run_episodes({}, walks, 5, kConfig, accumulate_update(kConfig)).model;
  const RefineConfig config;
  const FlowFieldIndex fields(crowded, config);
  const std::vector<Window> windows = windows_of(testing::corner_walks(20, 99), kConfig.sampling, kConfig.predict, 1.0);
  Scratch scratch;
  const auto many = std::ranges::count_if(windows, [&](const Window& window) {
    return fields.near(window.observed, fields.site(window.observed.frame), scratch).size() ==
           static_cast<std::size_t>(config.max_shortlisted);
  });
  EXPECT_GT(many, 20);
  const auto miss_m = [&](int shortlisted, bool stacking) {
    RefineConfig limited = kConfig.predict;
    limited.max_shortlisted = shortlisted;
    limited.stacking = stacking;
    return mean_miss_m(crowded, windows, limited);
  };
  EXPECT_LT(miss_m(config.max_shortlisted, true), miss_m(10000, true)) << "as good as all";
  // Of the roll-outs alone: the regressions after them can correct what a roll-out of one transition misses.
  EXPECT_LT(miss_m(config.max_shortlisted, false), 0.9 * miss_m(1, false)) << "what is left out too early is missed";
}

TEST(Predictor, AnswersWithAnEmptyModel) {
  const CurbTrajectory observed =
      observe(testing::walk("a", {{0, 0}, {10, 0}}, 1.0), 50, testing::square_frame(), 3.2, {});
  const Prediction prediction = predict(Model{}, observed, kConfig.predict);
  expect_sound(prediction);
  EXPECT_TRUE(prediction.fallback);
}

TEST(Predictor, AShorterHorizonIsThePrefixOfALongerOne) {
  RefineConfig brief = kConfig.predict, lengthy = kConfig.predict;
  brief.horizon_s = 2.0;
  lengthy.horizon_s = 9.0;
  const Predictor predictor(corner_model(), kConfig.predict), brief_one(corner_model(), brief),
      lengthy_one(corner_model(), lengthy);
  const auto windows = windows_of(testing::corner_walks(10, 98), kConfig.sampling, kConfig.predict, 1.0);
  ASSERT_FALSE(windows.empty());
  for (const Window& window : windows) {
    const Prediction a = brief_one.predict(window.observed), b = predictor.predict(window.observed),
                     c = lengthy_one.predict(window.observed);
    ASSERT_EQ(a.modes.size(), b.modes.size());
    ASSERT_EQ(c.modes.size(), b.modes.size());
    ASSERT_EQ(a.times_s.size(), 10u);
    ASSERT_EQ(c.times_s.size(), 45u);
    for (std::size_t m = 0; m < a.modes.size(); ++m) {
      EXPECT_EQ(a.modes[m].weight, b.modes[m].weight);
      EXPECT_EQ(c.modes[m].weight, b.modes[m].weight);
      for (std::size_t j = 0; j < 25; ++j) {
        if (j < 10) {
          EXPECT_EQ(a.modes[m].path_m[j], b.modes[m].path_m[j]);
        }
        EXPECT_EQ(c.modes[m].path_m[j], b.modes[m].path_m[j]);
      }
    }
  }
}

TEST(Predictor, AChangedOrShuffledFutureChangesNoPrediction) {
  const Predictor predictor(corner_model(), kConfig.predict);
  std::mt19937 random(17);
  for (const FramedTrajectory& placed : testing::corner_walks(8, 97)) {
    for (std::size_t last : prediction_samples(placed.track, 3.2, 2.0)) {
      Trajectory replaced = placed.track, shuffled = placed.track;
      for (std::size_t i = last + 1; i < replaced.times_s.size(); ++i) {
        replaced.positions_m[i] = Vector2(static_cast<double>(random() % 1000), -5.0);
        std::swap(shuffled.positions_m[i], shuffled.positions_m[last + 1 + random() % (i - last)]);
      }
      const auto line = [&](const Trajectory& track) {
        return predictor.predict(observe(track, last, placed.frame, 3.2, kConfig.sampling));
      };
      const Prediction expected = line(placed.track);
      for (const Trajectory& other : {replaced, shuffled}) EXPECT_EQ(line(other).modes, expected.modes);
    }
  }
}

// Whether a pedestrian will turn cannot be seen from afar, so the weights may be as even as people's choices are; but
// one of the modes must have what then happens.
TEST(Predictor, HasTheWayRoundTheCornerAmongItsModes) {
  RefineConfig apart = kConfig.predict;
  apart.merge_radius_m = 0.5;
  const Predictor predictor(corner_model(), apart);
  double ours = 0.0, constant = 0.0;
  int windows = 0;
  for (const Window& window : windows_of(testing::corner_walks(60, 96), kConfig.sampling, kConfig.predict, 1.0)) {
    if (window.future_m.size() < 25) continue;
    const Prediction prediction = predictor.predict(window.observed);
    double best = 1e9;
    for (const Mode& mode : prediction.modes)
      best = std::min(best, (mode.path_m.back() - window.future_m.back()).norm());
    ours += best;
    constant += (constant_velocity_m(window.observed, 5.0) - window.future_m.back()).norm();
    ++windows;
  }
  ASSERT_GT(windows, 50);
  EXPECT_LT(ours, 0.6 * constant);
}

TEST(Snapshot, OfALaterModelPredictsWhatOneMadeAnewPredicts) {
  const Model& earlier = corner_model();
  ASSERT_GE(earlier.transitions.size(), 4U);
  Model later = earlier;
  std::swap(later.transitions.front(), later.transitions.back());
  std::swap(later.refinement.residuals.front(), later.refinement.residuals.back());
  later.transitions[1].field.gp.response *= 1.3;
  later.refinement.residuals[2].response *= 0.7;
  const Snapshot first(earlier, kConfig.predict), second(later, kConfig.predict, &first);
  const Predictor anew(later, kConfig.predict);
  bool differs = false;
  for (const Window& window : windows_of(testing::corner_walks(20, 97), kConfig.sampling, kConfig.predict, 1.0)) {
    const Prediction a = anew.predict(window.observed), b = second.predictor.predict(window.observed);
    EXPECT_EQ(a.modes, b.modes);
    differs = differs || a.modes.front().path_m != first.predictor.predict(window.observed).modes.front().path_m;
  }
  EXPECT_TRUE(differs);
}

TEST(Predictor, RejectsNumbersThatAreNotFinite) {
  const CurbTrajectory observed =
      observe(testing::walk("a", {{0, 0}, {10, 0}}, 1.0), 50, testing::square_frame(), 3.2, kConfig.sampling);
  std::vector<CurbTrajectory> broken(4, observed);
  broken[0].positions[3].x() = broken[1].velocities[3].y() = broken[2].companions_mps.x() = broken[3].still_s = NAN;
  for (const CurbTrajectory& track : broken)
    EXPECT_THROW(Predictor(corner_model(), kConfig.predict).predict(track), std::invalid_argument);
}

TEST(Predictor, RefusesATrackSampledOtherwiseOrInOtherUnitsAndAHorizonThatIsNotPositive) {
  const SamplingConfig coarse{.interval_s = 0.4};
  CurbFrame in_widths = testing::square_frame();
  in_widths.unit_m = Vector2::Constant(2.5);
  for (const auto& [sampling, frame] : {std::pair{coarse, testing::square_frame()}, {kConfig.sampling, in_widths}}) {
    const CurbTrajectory observed = observe(testing::walk("a", {{0, 0}, {10, 0}}, 1.0), 50, frame, 3.2, sampling);
    EXPECT_THROW(Predictor(corner_model(), kConfig.predict).predict(observed), std::invalid_argument);
  }
  RefineConfig none = kConfig.predict;
  none.horizon_s = 0.0;
  EXPECT_THROW(Predictor(corner_model(), none), std::invalid_argument);
}

/// A roll-out that stays at a point for 25 steps.
Rollout standing(const Vector2& point, double weight, const Matrix2& covariance, Scratch& scratch) {
  const auto path = scratch.array<Vector2>(25);
  const auto covariances = scratch.array<Matrix2>(25);
  std::fill(path.begin(), path.end(), point);
  std::fill(covariances.begin(), covariances.end(), covariance);
  Rollout rollout;
  rollout.weight = weight;
  rollout.path = path;
  rollout.covariances = covariances;
  return rollout;
}

TEST(Weights, FollowFromNegativeLogLikelihoodsAsInThePaper) {
  // NLL = (10, 11, 13) on paths far apart.
  Scratch scratch;
  std::vector<Rollout> rollouts;
  for (double nll : {13.0, 10.0, 11.0})
    rollouts.push_back(standing(Vector2(nll, 0.0), std::exp(10.0 - nll), Matrix2::Identity(), scratch));
  RefineConfig apart;
  apart.merge_radius_m = 0.1;
  const std::span<const Rollout> modes =
      merge_rollouts(rollouts, group_rollouts(rollouts, testing::square_frame(), 25, apart, scratch), scratch);
  ASSERT_EQ(modes.size(), 3u);
  EXPECT_NEAR(modes[0].weight, .7053845127, 1e-10);
  EXPECT_NEAR(modes[1].weight, .2594964603, 1e-10);
  EXPECT_NEAR(modes[2].weight, .0351190270, 1e-10);
}

TEST(Merging, MakesOneModeOfNearPathsAndKeepsTheirSpread) {
  Scratch scratch;
  std::vector<Rollout> rollouts;
  for (double y : {0.0, 0.4, 8.0})
    rollouts.push_back(standing(Vector2(0.0, y), y == 0.4 ? 1.0 : 3.0, Matrix2::Zero(), scratch));
  const std::span<const Rollout> modes =
      merge_rollouts(rollouts, group_rollouts(rollouts, testing::square_frame(1.0), 25, {}, scratch), scratch);
  ASSERT_EQ(modes.size(), 2u);
  EXPECT_NEAR(modes[0].weight, 4.0 / 7.0, 1e-12);
  EXPECT_NEAR(modes[0].path[3].y(), 0.1, 1e-12);
  EXPECT_NEAR(modes[0].covariances[3](1, 1), 0.75 * 0.01 + 0.25 * 0.09, 1e-12);
}

TEST(Predictor, OwnDeviationBeginsWithTheObservedVelocityAndFades) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(80, 21);
  EpisodeConfig config = with_profile({}, "paper").episode;
  config.predict.merge_radius_m = 0.0;
  const Model model = testing::learnt(tracks, config);
  RefineConfig without = config.predict;
  without.own_deviation = false;
  const Predictor own(model, config.predict), field(model, without);
  int compared = 0;
  for (const Window& window : windows_of(testing::corner_walks(20, 99), config.sampling, config.predict, 2.0)) {
    const CurbTrajectory& observed = window.observed;
    const Vector2 start = to_world(observed.frame, observed.positions.back());
    const Vector2 velocity = velocity_to_world(observed.frame, observed.velocities.back());
    const Prediction a = own.predict(observed), b = field.predict(observed);
    if (a.fallback || b.fallback) continue;
    ++compared;
    for (const Mode& mode : a.modes) EXPECT_LT((mode.path_m.front() - start - 0.2 * velocity).norm(), 1e-9);
    const Mode &first = a.modes.front(), &other = b.modes.front();
    EXPECT_LT(first.covariances_m2.front().trace(), other.covariances_m2.front().trace());  // it is known
    EXPECT_GT(first.covariances_m2.back().trace(), 10.0 * first.covariances_m2.front().trace());
  }
  EXPECT_GT(compared, 20);
}

}  // namespace
}  // namespace sila
