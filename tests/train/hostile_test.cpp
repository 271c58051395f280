#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "sila/model/packing.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"
#include "sila/train/training.hpp"
#include "support/hostile_tracks.hpp"
#include "support/sanitized.hpp"

namespace sila {
namespace {

using testing::Hostile;
using testing::HostileTracks;

const EpisodeConfig kConfig;

::testing::AssertionResult finite(const std::vector<double>& numbers, const char* part) {
  for (const double number : numbers) {
    if (!std::isfinite(number)) return ::testing::AssertionFailure() << part << " holds " << number;
  }
  return ::testing::AssertionSuccess();
}

/// Smallest noise of a field [widths²/s²]: as configured, or the floor of a fit.
double least_noise(const EpisodeConfig& config, const Model& model) {
  const double width_m = model.settings.reference_width_m;
  const FieldConfig& field = config.learn.field;
  const bool fitted = field.gp.hyperparameters != HyperparameterChoice::fixed;
  return (fitted ? field.gp.min_noise_variance : field.noise_std_mps * field.noise_std_mps) / (width_m * width_m);
}

/// Everything that a model promises whatever it was fitted.
void expect_sound(const Model& model, const EpisodeConfig& config) {
  ASSERT_NO_THROW(check(model));
  EXPECT_TRUE(finite(pack(model.settings), "settings"));
  for (const Site& site : model.sites) {
    EXPECT_TRUE(finite(pack(site.error_statistics), "error_statistics"));
    EXPECT_TRUE(finite(pack(site.global_residual), "global residual GP of a site"));
    EXPECT_TRUE(finite(pack(site.frame), "frame"));
  }
  EXPECT_TRUE(finite(pack(model.global_residual), "global_residual"));
  for (const MotionPrimitive& primitive : model.primitives) {
    EXPECT_TRUE(std::isfinite(primitive.weight));
    for (const CellVelocity& cell : primitive.cells) EXPECT_TRUE(cell.velocity.allFinite());
  }
  for (const Transition& transition : model.transitions) {
    EXPECT_TRUE(finite(pack(transition.field), "field"));
    EXPECT_TRUE(finite(pack(transition.residual), "residual"));
    EXPECT_GE(transition.field.gp.noise_variance, (1.0 - 1e-9) * least_noise(config, model));
  }
}

/// Smallest eigenvalue that a covariance of a prediction may have [m²]: that of an error of a millimetre, less what
/// the mode variants take.
double floor_m2(const EpisodeConfig& config) {
  const RefineConfig& predict = config.predict;
  const double taken = 2.0 * predict.variant_weight * predict.variant_reach * predict.variant_reach;
  return 1e-6 * (predict.mode_variants > 0 ? 1.0 - taken : 1.0) * (1.0 - 1e-3);
}

void expect_sound(const Prediction& prediction, double floor_m2) {
  ASSERT_FALSE(prediction.modes.empty());
  double sum = 0.0;
  for (const Mode& mode : prediction.modes) {
    EXPECT_GE(mode.weight, 0.0);
    sum += mode.weight;
    for (std::size_t j = 0; j < prediction.times_s.size(); ++j) {
      ASSERT_TRUE(mode.path_m[j].allFinite());
      ASSERT_TRUE(mode.covariances_m2[j].allFinite());
      const double least = mode.covariances_m2[j].selfadjointView<Eigen::Lower>().eigenvalues().minCoeff();
      ASSERT_GE(least, floor_m2) << "step " << j << ", covariance " << mode.covariances_m2[j];
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_GE(prediction.novelty, 0.0);
  EXPECT_LE(prediction.novelty, 1.0);
  for (std::size_t r = 0; r < prediction.regions.size(); ++r) {
    EXPECT_TRUE(finite(prediction.regions[r].levels, "levels"));
    for (std::size_t j = 0; j < prediction.times_s.size(); ++j) {
      EXPECT_GE(prediction.regions[r].levels[j], r == 0 ? 0.0 : prediction.regions[r - 1].levels[j]);
    }
  }
}

void expect_sound_predictions(const Model& model, const std::vector<FramedTrajectory>& tracks,
                              const EpisodeConfig& config) {
  const Predictor predictor(model, config.predict);
  Workspace workspace;
  for (const FramedTrajectory& track : tracks) {
    SCOPED_TRACE("track " + track.track.id);
    for (const Window& window : windows_of(std::span(&track, 1), config.sampling, config.predict, 4.0)) {
      expect_sound(predictor.predict(window.observed, workspace), floor_m2(config));
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

/// Learns, fuses, and predicts what comes next, and looks at everything in between.
Model expect_sound_life(const std::vector<std::vector<FramedTrajectory>>& batches,
                        const std::vector<FramedTrajectory>& test_walks, const EpisodeConfig& config) {
  Model model;
  try {
    for (const std::vector<FramedTrajectory>& batch : batches) {
      model = run_episode(model, batch, config).model;
      expect_sound(model, config);
      if (::testing::Test::HasFatalFailure()) return model;
    }
    expect_sound_predictions(model, test_walks, config);
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what();
  }
  return model;
}

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

TEST(Hostile, SoItIsWithoutTheBlendAndWithLimits) {
  EpisodeConfig config;
  config.predict.stacking = false;
  config.budget.max_primitives = 10;
  config.prune.half_life_episodes = 2.0;
  expect_sound_lives(50, config);
}

TEST(Hostile, SoItIsWithOptimisedFields) {
  EpisodeConfig config;
  config.learn.field.gp.hyperparameters = HyperparameterChoice::optimised;
  config.learn.field.gp.pseudo_inputs = PseudoInputChoice::optimised;
  config.predict.stacking = false;
  config.residual.enabled = false;
  expect_sound_lives(12, config);
  config.learn.field.gp.hyperparameters = HyperparameterChoice::pooled;
  config.learn.field.gp.pseudo_inputs = PseudoInputChoice::greedy;
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
  const Model model = run_episodes({}, testing::corner_walks(60, 3), 20, kConfig, sila_update(kConfig)).model;
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
  const Model model = run_episodes({}, testing::corner_walks(60, 3), 20, kConfig, sila_update(kConfig)).model;
  const Predictor predictor(model, kConfig.predict);
  RefineConfig plain = kConfig.predict;
  plain.stacking = false;
  const Predictor unfitted(model, plain);
  HostileTracks hostile(11);
  for (int trial = 0; trial < 1000; ++trial) {
    SCOPED_TRACE("seed 11, trial " + std::to_string(trial));
    const CurbTrajectory window = random_window(hostile);
    expect_sound(predictor.predict(window), floor_m2(kConfig));
    expect_sound(unfitted.predict(window), 0.0);
    if (HasFailure()) return;
  }
  CurbTrajectory absurd = random_window(hostile);
  absurd.velocities.front().x() = 1e200;
  EXPECT_THROW(predictor.predict(absurd), std::invalid_argument);
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
