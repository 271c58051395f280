#include <gtest/gtest.h>

#include <cmath>

#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/hostile_tracks.hpp"
#include "support/learnt.hpp"
#include "support/message_of.hpp"
#include "support/sanitized.hpp"
#include "support/sound.hpp"

namespace sila {
namespace {

using testing::Hostile;
using testing::HostileTracks;

using testing::expect_sound;
using testing::expect_sound_life;
using testing::expect_sound_predictions;
const EpisodeConfig kConfig;

/// So many lives of mixtures, each with a seed of its own.
void expect_sound_lives(int lives, const EpisodeConfig& config) {
  for (int seed = 1; seed <= testing::repeats(lives); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    HostileTracks hostile(static_cast<std::uint64_t>(seed));
    const std::vector batches{hostile.mixture(8), hostile.mixture(8), hostile.mixture(8)};
    expect_sound_life(batches, hostile.mixture(16), config);
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(Hostile, AnyMixtureOfTracksIsLearntFusedAndPredicted) {
  expect_sound_lives(200, kConfig);
}

TEST(Hostile, SoItIsWithoutStackingAndWithABudget) {
  EpisodeConfig config;
  config.predict.stacking = false;
  config.budget.max_primitives = 10;
  expect_sound_lives(50, config);
}

TEST(Hostile, SoItIsWithOptimisedFields) {
  EpisodeConfig config;
  config.learn.field.gp.pseudo_inputs = PseudoInputChoice::optimised;
  config.predict.stacking = false;
  config.residual.enabled = false;
  expect_sound_lives(12, config);
}

TEST(Hostile, EveryKindAloneAndEveryTrackTheSameOneIsLearntFusedAndPredicted) {
  for (int kind = 0; kind < testing::kHostileKinds; ++kind) {
    for (const bool all_alike : {false, true}) {
      SCOPED_TRACE(std::string(testing::kHostileNames[static_cast<std::size_t>(kind)]) + (all_alike ? ", alike" : ""));
      HostileTracks hostile(static_cast<std::uint64_t>(kind + 1));
      std::vector<std::vector<FramedTrajectory>> batches;
      for (int episode = 0; episode < 3; ++episode)
        batches.push_back(hostile.many(static_cast<Hostile>(kind), 20, all_alike));
      std::vector<FramedTrajectory> test_walks = hostile.mixture(10);
      test_walks.insert(test_walks.end(), batches.back().begin(), batches.back().end());
      expect_sound_life(batches, test_walks, kConfig);
      if (HasFailure()) return;
    }
  }
}

TEST(Hostile, PeopleWhoAllDoTheSameDoNotMakeAPredictionSurerThanAMillimetre) {
  EpisodeConfig config;
  config.error_statistics.stride_s = 0.1;
  std::vector<FramedTrajectory> same = HostileTracks(7).many(Hostile::identical_points, testing::repeats(300), true);
  Model model;
  for (int episode = 0; episode < 12; ++episode) {
    model = run_episode(model, same, config).model;
    same.pop_back();  // or it would be known
  }
  expect_sound(model, config);
  expect_sound_predictions(model, same, config);
}

TEST(Hostile, AnyWindowIsPredictedByASaneModel) {
  const Model model = testing::learnt(testing::corner_walks(60, 3));
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    HostileTracks hostile(seed);
    expect_sound_predictions(model, hostile.mixture(20), kConfig);
  }
}

/// A window of random numbers of any size that is allowed, at the model's interval.
CurbTrajectory random_window(HostileTracks& hostile) {
  CurbTrajectory window{"random", testing::square_frame(), {}, {}, {}};
  const auto number = [&] {
    const double size = std::pow(10.0, hostile.uniform(-320.0, 12.0));
    return hostile.number() % 2 == 0 ? size : -size;
  };
  const int samples = 1 + static_cast<int>(hostile.number() % 16);
  for (int k = 0; k < samples; ++k) {
    window.times_s.push_back(0.2 * k);
    window.positions.emplace_back(number(), number());
    window.velocities.emplace_back(number(), number());
  }
  return window;
}

TEST(Hostile, NumbersOfAnySizeArePredictedOrRejected) {
  const Model model = testing::learnt(testing::corner_walks(60, 3));
  const Predictor predictor(model, kConfig.predict);
  RefineConfig plain = kConfig.predict;
  plain.stacking = false;
  const Predictor unfitted(model, plain);
  HostileTracks hostile(11);
  for (int trial = 0; trial < 1000; ++trial) {
    SCOPED_TRACE("seed 11, trial " + std::to_string(trial));
    const CurbTrajectory window = random_window(hostile);
    expect_sound(predictor.predict(window));
    expect_sound(unfitted.predict(window));
    if (HasFailure()) return;
  }
  CurbTrajectory absurd = random_window(hostile);
  absurd.velocities.front().x() = 1e200;
  EXPECT_THROW(predictor.predict(absurd), std::invalid_argument);
}

TEST(Hostile, TracksWithoutSamplesAreRejected) {
  const std::vector<FramedTrajectory> tracks(2, {{"a", {}, {}}, testing::square_frame()});
  const auto expect_rejected = [](auto&& action) {
    EXPECT_TRUE(says(message_of(action), "trajectory 'a', sample 0: there is no sample"));
  };
  expect_rejected([&] { PresentPeople{tracks}; });
  expect_rejected([&] { windows_of(tracks, {}, {}, 1.0); });
  expect_rejected([&] { run_episode({}, tracks, kConfig); });
  expect_rejected([&] { evaluate(Model{}, tracks, kConfig, {}); });
  expect_rejected([&] { split_tracks(tracks, 0.5, 1, SplitBy::time); });
}

TEST(Hostile, TracksThatLastForeverOrAreNowhereAreRejectedAtOnce) {
  const auto rejected = [](double start_s, double step_s, double place_m) {
    FramedTrajectory placed{{"a", {start_s, start_s + step_s}, {{place_m, 0.0}, {place_m, 1.0}}},
                            testing::square_frame()};
    EXPECT_THROW(run_episode({}, std::span(&placed, 1), kConfig), std::invalid_argument) << start_s << " " << step_s;
  };
  rejected(0.0, 1e11, 0.0);   // as many states as fit in no memory
  rejected(1e17, 1e5, 0.0);   // a clock on which a second passes unseen
  rejected(0.0, 1.0, 1e200);  // a square is infinite
}

}  // namespace
}  // namespace sila
