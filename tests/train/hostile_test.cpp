#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"
#include "support/message_of.hpp"
#include "support/sanitized.hpp"
#include "support/sound.hpp"

namespace sila {
namespace {

using testing::expect_sound;
using testing::expect_sound_life;
using testing::expect_sound_predictions;

const EpisodeConfig kConfig;

/// Tracks that no tracker should give and that some tracker will.
enum class Hostile {
  standing,
  identical_points,
  thousand_in_one_cell,
  collinear,
  far_away,
  millimetre_grid,
  reversals,
  one_sample,
  two_samples,
  tiny_steps,
  huge_steps,
  one_huge_jump,
  many_huge_jumps,
  tracker_noise,
  late_clock,
  ordinary,
};

constexpr std::array kHostileNames = {
    "standing",        "identical_points", "thousand_in_one_cell", "collinear",  "far_away",   "millimetre_grid",
    "reversals",       "one_sample",       "two_samples",          "tiny_steps", "huge_steps", "one_huge_jump",
    "many_huge_jumps", "tracker_noise",    "late_clock",           "ordinary"};
constexpr int kHostileKinds = static_cast<int>(kHostileNames.size());

/// Draws hostile tracks; the same seed gives the same ones.
class HostileTracks {
 public:
  explicit HostileTracks(std::uint64_t seed) : random_(seed) {}

  FramedTrajectory draw(Hostile kind, const std::string& id) {
    Trajectory track = path(kind);
    track.id = id;
    return {std::move(track), testing::square_frame()};
  }

  /// Tracks of random kinds; about one in three is an ordinary walk.
  std::vector<FramedTrajectory> mixture(int count) {
    std::vector<FramedTrajectory> tracks;
    for (int i = 0; i < count; ++i) {
      const bool usual = uniform(0.0, 1.0) < 0.3;
      const auto kind = usual ? Hostile::ordinary : static_cast<Hostile>(random_() % kHostileKinds);
      tracks.push_back(draw(kind, std::string(kHostileNames[static_cast<std::size_t>(kind)]) + std::to_string(i)));
    }
    return tracks;
  }

  /// Tracks of one kind; with `all_alike` the same one again and again.
  std::vector<FramedTrajectory> many(Hostile kind, int count, bool all_alike) {
    std::vector<FramedTrajectory> tracks;
    for (int i = 0; i < count; ++i) {
      tracks.push_back(all_alike && i > 0 ? tracks.front() : draw(kind, ""));
      tracks.back().track.id = "t" + std::to_string(i);
    }
    return tracks;
  }

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::uint64_t number() { return random_(); }

 private:
  Vector2 somewhere(double radius_m) { return {uniform(-radius_m, radius_m), uniform(-radius_m, radius_m)}; }
  Vector2 noise(double std_m) {
    std::normal_distribution<double> normal(0.0, std_m);
    return {normal(random_), normal(random_)};
  }

  Trajectory walk_somewhere(double speed_mps) {
    const Vector2 from = somewhere(14.0), over = somewhere(3.0), to = somewhere(14.0);
    return testing::walk("", {from, over, to}, speed_mps, 0.1, 0.02, static_cast<unsigned>(random_()));
  }

  Trajectory path(Hostile kind) {
    const Vector2 place = somewhere(14.0), way = somewhere(1.0);
    switch (kind) {
      case Hostile::standing:
        return testing::sampled(100, 0.1, [&](int) { return Vector2(place + noise(0.01)); });
      case Hostile::identical_points:
        return testing::sampled(100, 0.1, [&](int) { return place; });
      case Hostile::thousand_in_one_cell:
        return testing::sampled(1000, 0.05, [&](int) { return Vector2(Vector2(0.5, 0.5) + somewhere(0.45)); });
      case Hostile::collinear:
        return testing::sampled(100, 0.1, [&](int k) { return Vector2(place + 0.1 * k * Vector2::UnitX()); });
      case Hostile::far_away:
        return testing::sampled(100, 0.1, [&](int k) { return Vector2(Vector2(1e6, -1e6) + place + 0.1 * k * way); });
      case Hostile::millimetre_grid:
        return testing::sampled(
            200, 0.05, [&](int k) { return Vector2((1e3 * (place + 1e-3 * k * way)).array().round().matrix() / 1e3); });
      case Hostile::reversals:
        return testing::sampled(
            150, 0.1, [&](int k) { return Vector2(place + (k % 20 < 10 ? k % 20 : 20 - k % 20) * 0.15 * way); });
      case Hostile::one_sample:
        return testing::sampled(1, 0.1, [&](int) { return place; });
      case Hostile::two_samples:
        return testing::sampled(2, uniform(0.01, 6.0), [&](int k) { return Vector2(place + k * way); });
      case Hostile::tiny_steps:
        return testing::sampled(2000, 1e-6, [&](int k) { return Vector2(place + 1e-3 * k * way + noise(0.01)); });
      case Hostile::huge_steps:
        return testing::sampled(8, 59.0, [&](int) { return somewhere(14.0); });
      case Hostile::one_huge_jump: {
        Trajectory track = walk_somewhere(1.3);
        track.positions_m[random_() % track.positions_m.size()] += somewhere(1e6);
        return track;
      }
      case Hostile::many_huge_jumps:
        return testing::sampled(80, 0.1, [&](int) { return somewhere(1e6); });
      case Hostile::tracker_noise:
        return testing::sampled(100, 0.1, [&](int k) { return Vector2(place + 0.1 * k * way + noise(1.0)); });
      case Hostile::late_clock: {
        Trajectory track = walk_somewhere(1.3);
        for (double& time_s : track.times_s) time_s += 1e12 - 1e3;
        return track;
      }
      case Hostile::ordinary:
        return walk_somewhere(uniform(0.6, 2.0));
    }
    return {};
  }

  std::mt19937_64 random_;
};

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
  for (int kind = 0; kind < kHostileKinds; ++kind) {
    for (const bool all_alike : {false, true}) {
      SCOPED_TRACE(std::string(kHostileNames[static_cast<std::size_t>(kind)]) + (all_alike ? ", alike" : ""));
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
