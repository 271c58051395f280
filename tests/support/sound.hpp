#pragma once

// What a model and a prediction promise whatever was learnt, under every configuration.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

#include "sila/model/packing.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"

namespace sila::testing {

inline ::testing::AssertionResult finite(const std::vector<double>& numbers, const char* part) {
  for (const double number : numbers) {
    if (!std::isfinite(number)) return ::testing::AssertionFailure() << part << " holds " << number;
  }
  return ::testing::AssertionSuccess();
}

/// Smallest noise variance of a field [curb units²/s²]: as configured, or the floor of a fit.
inline double least_noise(const EpisodeConfig& config, const Model& model) {
  const double width_m = model.settings.reference_width_m;
  const FieldConfig& field = config.learn.field;
  const bool fitted = field.gp.pseudo_inputs == PseudoInputChoice::optimised;
  return (fitted ? field.gp.min_noise_variance : field.noise_std_mps * field.noise_std_mps) / (width_m * width_m);
}

/// Bit for bit, since a file has the lower triangle alone.
inline ::testing::AssertionResult symmetric(const SparseGp& gp) {
  if (gp.information == gp.information.transpose()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "information is not symmetric:\n" << gp.information;
}

/// Everything that a model promises whatever it was fitted.
inline void expect_sound(const Model& model, const EpisodeConfig& config) {
  ASSERT_NO_THROW(check(model));
  EXPECT_TRUE(finite(pack(AllSettings{model.settings, model.refinement.residual_settings}), "settings"));
  for (const Site& site : model.sites) EXPECT_TRUE(finite(pack(site.frame), "frame"));
  for (const ErrorStatistics& statistics : model.refinement.error_statistics)
    EXPECT_TRUE(finite(pack(statistics), "error_statistics"));
  for (const SparseGp& residual : model.refinement.residuals) {
    EXPECT_TRUE(finite(pack(residual), "residual"));
    EXPECT_TRUE(symmetric(residual));
  }
  for (const MotionPrimitive& primitive : model.primitives) {
    EXPECT_TRUE(std::isfinite(primitive.weight));
    for (const CellVelocity& cell : primitive.cells) EXPECT_TRUE(cell.velocity.allFinite());
  }
  for (const Transition& transition : model.transitions) {
    EXPECT_TRUE(finite(pack(transition.field), "field"));
    for (const SparseGp* gp : {&transition.field.gp, &transition.field.gp_y}) EXPECT_TRUE(symmetric(*gp));
    EXPECT_GE(transition.field.gp.noise_variance, (1.0 - 1e-9) * least_noise(config, model));
  }
}

/// The heaviest mode is first; covariances are at least that of an error of a millimetre.
inline void expect_sound(const Prediction& prediction) {
  constexpr double floor_m2 = 1e-6 * (1.0 - 1e-3);
  ASSERT_FALSE(prediction.modes.empty());
  double sum = 0.0, last = 1.0;
  for (const Mode& mode : prediction.modes) {
    EXPECT_GE(mode.weight, 0.0);
    EXPECT_LE(mode.weight, last + 1e-15);
    last = mode.weight;
    sum += mode.weight;
    ASSERT_EQ(mode.path_m.size(), prediction.times_s.size());
    ASSERT_EQ(mode.covariances_m2.size(), prediction.times_s.size());
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

inline void expect_sound_predictions(const Model& model, const std::vector<FramedTrajectory>& tracks,
                                     const EpisodeConfig& config) {
  const Predictor predictor(model, config.predict);
  Workspace workspace;
  for (const FramedTrajectory& track : tracks) {
    SCOPED_TRACE("track " + track.track.id);
    for (const Window& window : windows_of(std::span(&track, 1), config.sampling, config.predict, 4.0)) {
      expect_sound(predictor.predict(window.observed, workspace));
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

/// Learns, fuses, and predicts what comes next, and looks at everything in between.
inline Model expect_sound_life(const std::vector<std::vector<FramedTrajectory>>& batches,
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

}  // namespace sila::testing
