#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sila/io/model_file.hpp"
#include "sila/model/model.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {

using tests::content_of;
using tests::ScratchFolder;

inline Eigen::MatrixXd random_matrix(std::mt19937_64& random, Eigen::Index rows, Eigen::Index columns) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

inline MotionPrimitive random_primitive(std::mt19937_64& random) {
  std::uniform_real_distribution<double> angle(0.0, 6.28);
  std::uniform_real_distribution<double> length(0.1, 1.0);
  MotionPrimitive primitive;
  const int cells = 1 + static_cast<int>(random() % 9);
  for (int i = 0; i < cells; ++i) {
    const double direction = angle(random);
    const Vector2 velocity = length(random) * Vector2(std::cos(direction), std::sin(direction));
    primitive.cells.push_back({CellKey{i - 4, static_cast<std::int32_t>(random() % 7) - 3}, velocity});
  }
  primitive.weight = 1.0 + length(random);
  return primitive;
}

inline SparseGp random_gp(std::mt19937_64& random, Eigen::Index inputs, Eigen::Index outputs) {
  const auto pseudo_inputs = static_cast<Eigen::Index>(1 + random() % 8);
  SparseGp gp;
  gp.kernel.signal_variance = 0.3;
  gp.kernel.length_scales = random_matrix(random, inputs, 1).cwiseAbs() + Eigen::MatrixXd::Constant(inputs, 1, 0.1);
  gp.noise_variance = 1.0 / 3.0;
  gp.pseudo_inputs = random_matrix(random, inputs, pseudo_inputs);
  gp.mean = random_matrix(random, outputs, 1);
  const Eigen::MatrixXd root = random_matrix(random, pseudo_inputs, pseudo_inputs);
  gp.information = root * root.transpose();
  gp.response = random_matrix(random, pseudo_inputs, outputs);
  gp.mean_response = random_matrix(random, pseudo_inputs, 1);
  gp.points = 17.0;
  gp.jitter = 1e-5;
  return gp;
}

inline FlowField random_field(std::mt19937_64& random) {
  return {random_gp(random, 2, 2), Eigen::AlignedBox2d(Vector2(-1.0, -2.0), Vector2(3.0, 0.1))};
}

inline ErrorStatistics random_error_statistics(std::mt19937_64& random) {
  ErrorStatistics error_statistics;
  error_statistics.steps = 2;
  error_statistics.interval_s = 0.4;
  error_statistics.observe_s = 1.6;
  const auto regression = [&](double weight, int features, int outputs) {
    return RegressionMoments{weight, random_matrix(random, features, features).triangularView<Eigen::Lower>(),
                             random_matrix(random, features, outputs)};
  };
  const auto density = [&](double weight) {
    DensityMoments moments{regression(weight, kScaleFeatures, kScaleOutputs), {}};
    for (int i = 0; i < error_statistics.steps * kMixtureComponents; ++i)
      moments.components.push_back({0.3 * i, 1.0 / 7.0, 0.1 * weight});
    return moments;
  };
  error_statistics.density.fill(density(1.5));
  error_statistics.density[kWalking] = density(2.5);
  error_statistics.density_place_free.fill(density(0.25));
  error_statistics.changes = {regression(3.0, kHazardFeatures, 1), regression(0.5, kHazardFeatures, 1)};
  error_statistics.global_motion.fill(regression(2.5, kMotionFeatures, kCorrectionKnots));
  error_statistics.motion.fill(regression(1.5, kMotionFeatures, kCorrectionKnots));
  error_statistics.motion_share = regression(1.5, 1, 1);
  error_statistics.correction = regression(1.5, kCorrectionFeatures, 2 * kCorrectionKnots);
  error_statistics.correction_share = regression(1.5, 1, 1);
  for (int i = 0; i < error_statistics.steps * kSpeedClasses; ++i) {
    error_statistics.stacking.push_back(regression(0.1 * i, kStackedFeatures, 1));
  }
  for (int i = 0; i < error_statistics.steps * kScoreClasses; ++i)
    error_statistics.scores.emplace_back(kScoreBins, 0.1 * i).front() = 1.0 / 3.0;
  error_statistics.novelties.assign(kNoveltyBins, 0.25);
  error_statistics.novelties[1] = 2.0;
  error_statistics.novelties[2] = 1.0 / 3.0;
  for (std::size_t c = 0; c < kSlowClasses; ++c) {
    SlowErrors& slow = error_statistics.slow.emplace_back(SlowErrors{3.5, {}});
    slow.errors_m.fill(1.0 / 7.0);
  }
  return error_statistics;
}

/// A model that passes check(), different for every seed.
inline Model random_model(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Model model;
  model.settings.grid.cell = 0.7;
  model.settings.grid.origin = random_matrix(random, 2, 1);
  model.settings.scaling = static_cast<CurbScaling>(seed % kCurbScalings.size());
  model.settings.reference_width_m = 2.1;
  model.refinement.residual_settings.horizon_s = 4.5;
  model.refinement.residual_settings.knots = 3;
  const int primitives = 3 + static_cast<int>(random() % 10);
  for (int i = 0; i < primitives; ++i) model.primitives.push_back(random_primitive(random));
  for (int from = 0; from < primitives; ++from) {
    for (int to = from; to < primitives; to += 2) {
      model.transitions.push_back({from, to, 1.0 + from, random_field(random)});
      model.refinement.residuals.push_back(random_gp(random, kResidualInputs, 6));
    }
  }
  model.sharing = SiteSharing::shared;
  model.sites.resize(2);
  for (Site& site : model.sites) {
    site.episodes = static_cast<int>(seed % 100);
    site.tracks = 10 * site.episodes;
    model.refinement.error_statistics.push_back(random_error_statistics(random));
  }
  model.sites[1].frame.origin_m = Vector2(10.0, 0.0) + random_matrix(random, 2, 1);
  model.refinement.prior = random_error_statistics(random);
  for (Transition& transition : model.transitions) {
    const auto seen_in = [&] { return static_cast<int>(random() % (seed % 100 + 1)); };
    transition.sites = {{0, 0.25 * transition.count, seen_in()}, {1, 0.75 * transition.count, seen_in()}};
  }
  for (Transition& transition : model.transitions) transition.support = transition.from + 1;
  for (std::size_t i = 0; i < model.primitives.size(); ++i) model.primitives[i].support = static_cast<int>(2 * i);
  model.episodes = static_cast<int>(seed % 100);
  model.tracks = 20 * model.episodes;
  for (int i = 0; i < model.episodes; ++i) model.episode_ids.push_back({random(), random()});
  std::ranges::sort(model.episode_ids);
  return model;
}

/// Sets the count of a transition, and those of its sites to add up to it.
inline void set_count(Transition& transition, double count) {
  for (SiteCount& part : transition.sites) part.count *= count / transition.count;
  transition.count = count;
}

inline ErrorStatistics of_one_step(ErrorStatistics error_statistics) {
  error_statistics.steps = 1;
  error_statistics.stacking.resize(kSpeedClasses);
  for (Densities* densities : {&error_statistics.density, &error_statistics.density_place_free}) {
    for (DensityMoments& density : *densities) density.components.resize(kMixtureComponents);
  }
  error_statistics.scores.resize(kScoreClasses);
  return error_statistics;
}

inline EpisodeRecord record(int number) {
  return {number, 20, 0.125, 3, 5, R"({"note": "made up"})"};
}

inline bool same_records(const std::vector<EpisodeRecord>& a, const std::vector<EpisodeRecord>& b) {
  return std::ranges::equal(a, b, [](const EpisodeRecord& x, const EpisodeRecord& y) {
    return x.number == y.number && x.tracks == y.tracks && x.seconds == y.seconds && x.size_before == y.size_before &&
           x.size_after == y.size_after && x.statistics == y.statistics && x.committed_s == y.committed_s;
  });
}

inline StoredModel stored(const Model& model) {
  return {model, R"({"threshold": 0.7})", {record(1), record(2)}, "", 0};
}

/// The episode of this number, with a model of this seed.
inline void commit(ModelFile& file, int episode) {
  file.commit(random_model(static_cast<std::uint64_t>(episode)), record(episode), "{}");
}

}  // namespace sila
