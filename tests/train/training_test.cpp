#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <iterator>
#include <numeric>
#include <random>
#include <set>

#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/model/packing.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "support/message_of.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

TEST(Episode, SizeNeverExceedsThatOfAccumulateAndTracksAddUp) {
  for (unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const std::vector<FramedTrajectory> tracks = testing::corner_walks(100, seed);
    const Training fused = run_episodes({}, tracks, 20, kConfig, sila_update(kConfig));
    const Training sum = run_episodes({}, tracks, 20, kConfig, accumulate_update(kConfig));
    ASSERT_EQ(fused.episodes.size(), 5u);
    for (std::size_t n = 0; n < 5; ++n) EXPECT_LE(fused.episodes[n].size_after, sum.episodes[n].size_after);
    EXPECT_LT(size(fused.model), size(sum.model));
    EXPECT_EQ(fused.model.tracks, 100);
    EXPECT_EQ(fused.model.episodes, 5);
    EXPECT_NO_THROW(check(fused.model));
    EXPECT_NO_THROW(check(sum.model));
  }
}

TEST(Episode, GivesTheSameModelOnOneThreadAndOnMany) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(60, 5);
  const auto learnt = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return testing::learnt(tracks);
  };
  const Model one = learnt(1), two = learnt(2), eight = learnt(8);
  EXPECT_TRUE(identical(one, two));
  EXPECT_TRUE(identical(one, eight));
}

TEST(Episode, ErrorStatisticsAreLearntBeforeTheBatchIsAndDoNotGrow) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(60, 6);
  const Training run = run_episodes({}, tracks, 20, kConfig, sila_update(kConfig));
  ASSERT_FALSE(run.model.refinement.error_statistics.at(0).empty());
  const Training longer = run_episodes(run.model, testing::corner_walks(60, 7), 20, kConfig, sila_update(kConfig));
  EXPECT_EQ(longer.model.refinement.error_statistics[0].stacking.size(),
            run.model.refinement.error_statistics[0].stacking.size());
  EpisodeConfig none = kConfig;
  none.error_statistics.enabled = false;
  EXPECT_TRUE(testing::learnt(tracks, none).refinement.error_statistics.at(0).empty());
}

TEST(Episode, ReportsThePrequentialErrorThatEvaluateFinds) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(60, 6);
  const auto batch = std::span(tracks).subspan(40);
  const Model before = testing::learnt(std::span(tracks).first(40));
  const PrequentialError error = run_episode(before, batch, kConfig).report.prequential;
  const EvaluateConfig as_often{.stride_s = kConfig.error_statistics.stride_s};
  const GroupScore moving = evaluate(before, batch, kConfig, as_often).groups[1];
  ASSERT_EQ(moving.name, "moving");
  ASSERT_GT(moving.windows, 20u);
  EXPECT_EQ(error.windows, moving.windows);
  const auto windows = static_cast<double>(moving.windows);
  EXPECT_NEAR(error.constant_m / windows, moving.constant.back().ade_m, 1e-9);
  EXPECT_NEAR(error.model_m / windows, moving.model.back().mean_path_ade_m, 1e-9);
  EXPECT_EQ(run_episode({}, batch, kConfig).report.prequential.windows, 0u) << "no model could predict it";
  EpisodeConfig none = kConfig;
  none.error_statistics.enabled = false;
  EXPECT_EQ(run_episode(before, batch, none).report.prequential.windows, 0u);
}

TEST(Episode, TheFirstBatchHasStatisticsOfModelsOfItsParts) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 6);
  const Model model = run_episode({}, tracks, kConfig).model;
  const Model parts = run_episodes({}, tracks, 5, kConfig, sila_update(kConfig)).model;
  const ErrorStatistics &of_batch = model.refinement.error_statistics.at(0),
                        &of_parts = parts.refinement.error_statistics.at(0);
  ASSERT_EQ(of_batch.stacking.size(), of_parts.stacking.size());
  for (std::size_t c = 0; c < of_parts.stacking.size(); ++c)
    EXPECT_EQ(of_batch.stacking[c].features, of_parts.stacking[c].features);
  EXPECT_EQ(of_batch.scores, of_parts.scores);
  EXPECT_EQ(model.sites[0].episodes, 1);
  EpisodeConfig none = kConfig;
  none.error_statistics.enabled = false;
  EXPECT_EQ(size(model), size(run_episode({}, tracks, none).model)) << "what is learnt of the batch does not change";
  // Too few for parts: nothing but constant velocity has predicted them.
  const Model few = run_episode({}, std::span(tracks).first(7), kConfig).model;
  for (const std::vector<double>& bins : few.refinement.error_statistics.at(0).scores)
    EXPECT_EQ(std::accumulate(bins.begin(), bins.end(), 0.0), 0.0);
}

TEST(Episode, RejectsAnotherObservedTimeOrHorizonThanTheErrorStatistics) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 8);
  EpisodeConfig kept = kConfig;
  kept.residual.enabled = false;  // whose horizon is compared, too
  const Model model = run_episode({}, tracks, kept).model;
  Model prior;
  prior.refinement.prior = model.refinement.error_statistics.front();
  EpisodeConfig shorter = kept, nearer = kept;
  shorter.predict.observe_s = 2.0;
  nearer.predict.horizon_s = 3.0;
  const auto why = [&](const Model& previous, const EpisodeConfig& config) {
    return message_of([&] { settings_for(previous, tracks.front().frame, config); });
  };
  for (const Model& previous : {model, prior}) {
    EXPECT_TRUE(says(why(previous, shorter), "predict.observe_s = 2, but the model began with 3.2"));
    EXPECT_TRUE(says(why(previous, nearer), "predict.horizon_s in whole steps = 3, but the model began with 5"));
    EXPECT_EQ(why(previous, kept), "");
    shorter.error_statistics.enabled = false;
    EXPECT_EQ(why(previous, shorter), "");
    shorter.error_statistics.enabled = true;
  }
}

TEST(Episode, RejectsAnotherGridOrIntervalThanTheModels) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 8);
  const Model model = run_episode({}, tracks, kConfig).model;
  EpisodeConfig other = kConfig;
  other.learn.grid.cell_m = 2.0;
  EXPECT_THROW(run_episode(model, tracks, other), std::invalid_argument);
  other = kConfig;
  other.sampling.interval_s = 0.1;
  EXPECT_THROW(run_episode(model, tracks, other), std::invalid_argument);
}

TEST(Episode, RejectsOtherOutputsHorizonOfResidualsOrScalingThanTheModels) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 8);
  const Model model = run_episode({}, tracks, kConfig).model;
  EpisodeConfig outputs = kConfig, nearer = kConfig, widths = kConfig;
  outputs.learn.field.outputs =
      model.transitions.front().field.independent() ? FieldOutputs::shared : FieldOutputs::independent;
  nearer.error_statistics.enabled = false;  // whose horizon is compared, too
  nearer.predict.horizon_s = 3.0;
  widths.scaling = CurbScaling::mean_width;
  const auto why = [&](const EpisodeConfig& config) { return message_of([&] { run_episode(model, tracks, config); }); };
  EXPECT_TRUE(says(why(outputs), "learn.field.outputs = "));
  EXPECT_TRUE(says(why(nearer), "predict.horizon_s of residual GPs (0: residual.enabled = false) = 3"));
  EXPECT_TRUE(says(message_of([&] { require_same_units(model, widths); }), "scaling = mean_width"));
  EXPECT_EQ(why(kConfig), "");
}

TEST(Episode, AnEmptyBatchChangesNothing) {
  const Model model = run_episode({}, testing::corner_walks(20, 9), kConfig).model;
  EXPECT_TRUE(identical(run_episode(model, {}, kConfig).model, model));
}

TEST(Retrain, SeesAllBatchesSoFar) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(40, 10);
  const Training retrained = run_episodes({}, tracks, 20, kConfig, retrain_update(kConfig));
  EXPECT_EQ(retrained.model.tracks, 40);
  EXPECT_EQ(retrained.model.episodes, 2);
  EpisodeConfig plain = kConfig;
  plain.error_statistics.enabled = plain.prune.enabled = false;
  const Model at_once = run_episode({}, tracks, plain).model;
  EXPECT_EQ(size(retrained.model), size(at_once));
}

TEST(Evaluate, CountsEveryTrackAndBeatsConstantVelocityRoundACorner) {
  const Model model = testing::learnt(testing::corner_walks(100, 12));
  std::vector<FramedTrajectory> tracks = testing::corner_walks(40, 13);
  tracks.push_back({testing::walk("brief", {{0, 0}, {2, 0}}, 1.0), testing::square_frame()});
  tracks.push_back({testing::walk("short future", {{0, 1}, {5, 1}}, 1.0), testing::square_frame()});
  const Evaluation evaluation = evaluate(model, tracks, kConfig, {});
  std::set<std::string> scored;
  for (const WindowScore& window : evaluation.windows) scored.insert(window.track);
  std::size_t skipped = 0;
  for (const auto& [reason, count] : evaluation.skipped) skipped += count;
  EXPECT_TRUE(evaluation.skipped.contains("a track must last at least 3.2 s observed and 5 s predicted"));
  EXPECT_EQ(scored.size() + skipped, tracks.size());
  EXPECT_EQ(evaluation.horizons_s, (std::vector<double>{1, 2, 3, 4, 5}));
  const GroupScore& turning = evaluation.groups[3];
  ASSERT_GT(turning.windows, 20u);
  EXPECT_LT(turning.model.back().weighted_mhd_m, turning.constant.back().weighted_mhd_m);
}

std::vector<FramedTrajectory> people_who_stand(unsigned count) {
  std::vector<FramedTrajectory> tracks;
  for (unsigned i = 0; i < count; ++i) {
    const double x = 2.0 + 0.1 * i;
    FramedTrajectory standing{
        testing::walk("s" + std::to_string(i), {{x, 1}, {x + 0.01, 1}}, 0.0008, 0.1, 0.02, 90 + i),
        testing::square_frame()};
    standing.track.recording = 100 + i;
    tracks.push_back(std::move(standing));
  }
  return tracks;
}

TEST(Episode, PeopleWhoStandHaveADensityOfTheirOwn) {
  const Model before = run_episode({}, testing::corner_walks(40, 3), kConfig).model;
  const Densities first = before.refinement.error_statistics[0].density;
  const Densities second =
      run_episode(before, people_who_stand(10), kConfig).model.refinement.error_statistics[0].density;
  EXPECT_GT(first[kWalking].scale.weight, 0.0);
  EXPECT_LE(second[kWalking].scale.weight, first[kWalking].scale.weight);  // fades, and no window is added
  EXPECT_GT(second[kStanding].scale.weight, first[kStanding].scale.weight + 20.0);
}

TEST(Episode, ShortWindowsHaveDensitiesOfTheirOwn) {
  const Model model = testing::learnt(testing::corner_walks(60, 3));
  const Densities& densities = model.refinement.error_statistics[0].density;
  double shorter = 0.0;
  for (std::size_t observed = 1; observed < kObservedClasses; ++observed) {
    EXPECT_GT(densities[observed * kMotionStates + kWalking].scale.weight, 10.0);
    shorter += densities[observed * kMotionStates + kWalking].scale.weight +
               densities[observed * kMotionStates + kStanding].scale.weight;
  }
  // Every other window once more, and three at the beginning of each track.
  EXPECT_NEAR(shorter, 0.5 * windows_in(densities) + 3 * 60, 0.1 * windows_in(densities));
}

TEST(Windows, OfPeopleWhoHaveJustAppearedBeginWithTheirTracks) {
  const std::vector<FramedTrajectory> tracks{
      {testing::walk("a", {{0, 1}, {9, 1}}, 1.0, 0.1, 0.0, 1), testing::square_frame()}};
  const PresentPeople present(tracks);
  const std::vector<double> observed_s{0.4, 0.8};
  const auto windows = first_windows_of(tracks, kConfig.sampling, kConfig.predict, observed_s, present);
  ASSERT_EQ(windows.size(), 2u);
  EXPECT_NEAR(windows[0].observed.times_s.back() - windows[0].observed.times_s.front(), 0.4, 1e-9);
  EXPECT_NEAR(windows[1].observed.times_s.back(), tracks[0].track.times_s.front() + 0.8, 1e-9);
  std::vector<FramedTrajectory> gap = tracks;  // no sample from 0.1 to 0.9 s
  Trajectory& track = gap[0].track;
  track.times_s.erase(track.times_s.begin() + 2, track.times_s.begin() + 9);
  track.positions_m.erase(track.positions_m.begin() + 2, track.positions_m.begin() + 9);
  EXPECT_EQ(first_windows_of(gap, kConfig.sampling, kConfig.predict, observed_s, PresentPeople(gap)).size(), 1u);
}

/// Stands for `still_s`, then walks away.
FramedTrajectory starts_after(const std::string& id, double still_s, unsigned seed) {
  Trajectory track = testing::walk(id, {{2, 1}, {14, 1}}, 1.3, 0.1, 0.01, seed);
  for (double& time_s : track.times_s) time_s += still_s;
  const auto samples = static_cast<std::size_t>(std::lround(still_s / 0.1));
  std::vector<double> times_s;
  for (std::size_t i = 0; i < samples; ++i) times_s.push_back(0.1 * static_cast<double>(i));
  track.times_s.insert(track.times_s.begin(), times_s.begin(), times_s.end());
  track.positions_m.insert(track.positions_m.begin(), samples, track.positions_m.front());
  return {std::move(track), testing::square_frame()};
}

TEST(Evaluate, ScoresWhenPeopleStart) {
  std::vector<FramedTrajectory> tracks;
  for (unsigned i = 0; i < 100; ++i)  // half of the people start after 5 to 6 s, the others much later
    tracks.push_back(starts_after("s" + std::to_string(i), i % 2 == 0 ? 5.0 + 0.02 * i : 40.0, i));
  const Model model = testing::learnt(std::span(tracks).first(60));
  const std::vector<ChangeScore> changes = evaluate(model, std::span(tracks).subspan(60), kConfig, {}).changes;
  ASSERT_FALSE(changes.empty());
  EXPECT_EQ(changes.front().motion_state, kStanding);
  EXPECT_GT(changes.front().windows, 50);
  for (const ChangeScore& score : changes) {
    if (score.motion_state != kStanding) continue;
    EXPECT_LT(score.brier, score.base_brier) << score.horizon_s;
    EXPECT_LT(score.calibration_error, 0.15) << score.horizon_s;
  }
}

TEST(Evaluate, ShowsTheModelLessOfTheSameWindows) {
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(80, 3);
  const Model model = testing::learnt(std::span(tracks).first(60));
  const Evaluation whole = evaluate(model, std::span(tracks).subspan(60), kConfig, {});
  const Evaluation recent = evaluate(model, std::span(tracks).subspan(60), kConfig, {.observed_s = 0.4});
  ASSERT_EQ(whole.windows.size(), recent.windows.size());
  for (std::size_t i = 0; i < whole.windows.size(); ++i) EXPECT_EQ(whole.windows[i].t0_s, recent.windows[i].t0_s);
  EXPECT_GT(recent.groups[0].model.back().ade_m, whole.groups[0].model.back().ade_m);
}

TEST(ErrorStatistics, ScoresUnderAnUnknownDensityCountLess) {
  const Model before = run_episode({}, testing::corner_walks(40, 3), kConfig).model;
  const double known = before.refinement.error_statistics[0].density[kWalking].scale.weight;
  ASSERT_LT(known, 500.0);
  const ErrorStatistics seen = error_statistics_on(before, testing::corner_walks(20, 4), kConfig)[0].statistics;
  double scores = 0.0;
  for (std::size_t speed = 0; speed < kSpeedClasses; ++speed)
    scores = std::accumulate(seen.scores[speed].begin(), seen.scores[speed].end(), scores);
  EXPECT_NEAR(scores, seen.density[kWalking].scale.weight * known / 500.0, 1e-9);
}

TEST(ErrorStatistics, ScoresOfStandingPeopleCountWithoutWalkers) {
  const ErrorStatistics seen = testing::learnt(people_who_stand(60)).refinement.error_statistics[0];
  ASSERT_LT(seen.density[kWalking].scale.weight, 10.0);
  EXPECT_GT(std::accumulate(seen.scores[0].begin(), seen.scores[0].end(), 0.0), 20.0);
}

TEST(ErrorStatistics, EachObservedClassIsFittedAtAnyInterval) {
  for (const double interval_s : {0.2, 0.25, 0.3, 0.5}) {
    EpisodeConfig config;
    config.sampling.interval_s = interval_s;
    const ErrorStatistics seen = testing::learnt(testing::corner_walks(40, 3), config).refinement.error_statistics[0];
    for (std::size_t observed = 0; observed < kObservedClasses; ++observed)
      EXPECT_GT(seen.density[observed * kMotionStates + kWalking].scale.weight, 0.0) << interval_s << " " << observed;
  }
}

TEST(ErrorStatistics, AWindowIsNotCutToItsWholeLength) {
  EpisodeConfig config;
  config.predict.observe_s = 1.0;  // 0.8 s between the first and the last sample
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(40, 3);
  const Model before = run_episode({}, std::span(tracks).first(20), config).model;
  const ErrorStatistics seen = error_statistics_on(before, std::span(tracks).subspan(20), config)[0].statistics;
  const std::size_t whole =
      windows_of(std::span(tracks).subspan(20), config.sampling, config.predict, config.error_statistics.stride_s)
          .size();
  EXPECT_LE(seen.density[kWalking].scale.weight + seen.density[kStanding].scale.weight, static_cast<double>(whole));
}

TEST(Evaluate, WindowsCutShortHaveEquallyManyStates) {
  std::vector<FramedTrajectory> tracks = testing::corner_walks(20, 3);
  std::mt19937 random(5);
  for (FramedTrajectory& placed : tracks) {  // irregular stamps
    Trajectory fewer{placed.track.id, {}, {}, placed.track.recording};
    for (std::size_t i = 0; i < placed.track.times_s.size(); i += 1 + random() % 4) {
      fewer.times_s.push_back(placed.track.times_s[i]);
      fewer.positions_m.push_back(placed.track.positions_m[i]);
    }
    placed.track = std::move(fewer);
  }
  const std::vector<double> observed_s{1.1};
  const std::vector<Window> windows = windows_of(tracks, kConfig.sampling, kConfig.predict, 0.8, observed_s);
  EXPECT_FALSE(windows.empty());
  for (const Window& window : windows) EXPECT_EQ(window.past_m.size(), 6U) << window.observed.id;
}

TEST(Evaluate, PeopleWhoStandErrNoMoreThanTheBetterReference) {
  std::vector<FramedTrajectory> tracks = testing::corner_walks(60, 21);
  std::ranges::move(people_who_stand(60), std::back_inserter(tracks));
  const Split split = split_tracks(std::move(tracks), 0.25, 5, SplitBy::track);
  const Model model = testing::learnt(split.train);
  const GroupScore standing = evaluate(model, split.test, kConfig, {}).groups[2];
  ASSERT_EQ(standing.name, "standing");
  ASSERT_GT(standing.windows, 40u);
  const double better_m = std::min(standing.references[0].weighted_mhd_m, standing.references[1].weighted_mhd_m);
  EXPECT_LT(standing.model.back().weighted_mhd_m, better_m);  // the position is smoothed, so it may be below
}

TEST(Evaluate, ScoresAsFarAsIsPredictedWhereTheHorizonIsNoMultipleOfTheInterval) {
  EpisodeConfig config;
  config.sampling.interval_s = 0.3;  // 16 steps in 5 s, and the 17th is nearer to it
  const std::vector<FramedTrajectory> tracks = testing::corner_walks(40, 9);
  const Model model = testing::learnt(tracks, config);
  EXPECT_EQ(model.refinement.error_statistics.at(0).steps, 16);
  const Evaluation evaluation = evaluate(model, tracks, config, {});
  EXPECT_EQ(evaluation.groups.front().model.size(), evaluation.horizons_s.size());
  EXPECT_GT(evaluation.groups.front().windows, 0u);
}

TEST(Evaluate, TellsTurningFromStraightWalks) {
  for (const double interval_s : {0.1, 0.2, 0.4}) {
    const auto change_rad = [&](const std::vector<Vector2>& way) {
      return heading_change_rad(testing::walk("a", way, 1.0, interval_s).positions_m, interval_s);
    };
    EXPECT_NEAR(change_rad({{0, 0}, {8, 0}}), 0.0, 1e-9);
    EXPECT_NEAR(change_rad({{0, 0}, {4, 0}, {4, 4}}), 1.5707963, 1e-6);
    EXPECT_NEAR(change_rad({{0, 0}, {4, 0}, {4, -4}}), 1.5707963, 1e-6);
    EXPECT_NEAR(change_rad({{0, 0}, {0.4, 0}, {0.4, 4}}), 0.7853982, 1e-6)
        << "half of the first 0.8 s is before the turn";
  }
}

}  // namespace
}  // namespace sila
