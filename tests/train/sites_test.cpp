// Several sites in one model: each predicts as if it were alone.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "refine/error_statistics.hpp"
#include "sila/refine/outcomes.hpp"
#include "sila/train/episode.hpp"
#include "sila/train/fleet.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

using testing::learnt;

using Tracks = std::vector<FramedTrajectory>;

const EpisodeConfig kConfig;

/// The corner at the origin, and one far away that is turned and narrower, where people walk slower.
Tracks here(int count, unsigned seed) {
  return testing::corner_walks(count, seed);
}

Tracks there(int count, unsigned seed) {
  Tracks tracks = testing::walks_at(make_curb_frame({200, 50}, {0, 1}, {-1, 0}, 1.8), count, seed);
  for (FramedTrajectory& placed : tracks) {
    for (double& t : placed.track.times_s) t *= 1.3;
  }
  return tracks;
}

/// Largest distance of the mean paths of two models on the windows of tracks [m].
double apart_m(const Model& a, const Model& b, const Tracks& tracks) {
  const Predictor of_a(a, kConfig.predict), of_b(b, kConfig.predict);
  double largest = 0.0;
  for (const Window& window : windows_of(tracks, kConfig.sampling, kConfig.predict, 1.0)) {
    const Prediction first = of_a.predict(window.observed), second = of_b.predict(window.observed);
    const std::size_t steps = first.times_s.size();
    const std::vector<Vector2> path_a = mean_path(first, steps), path_b = mean_path(second, steps);
    for (std::size_t j = 0; j < steps; ++j) largest = std::max(largest, (path_a[j] - path_b[j]).norm());
  }
  return largest;
}

/// Mean distance of the mean path from what happened at the end of the horizon [m].
double error_m(const Model& model, const Tracks& tracks) {
  const Predictor predictor(model, kConfig.predict);
  double sum = 0.0, count = 0.0;
  for (const Window& window : windows_of(tracks, kConfig.sampling, kConfig.predict, 1.0)) {
    if (window.future_m.size() < 25) continue;
    sum += (mean_path(predictor.predict(window.observed), 25).back() - window.future_m[24]).norm();
    count += 1.0;
  }
  return sum / count;
}

TEST(Sites, LearntTogetherPredictAsApartInAnyOrder) {
  const Tracks a = here(60, 1), b = there(60, 2), test_a = here(10, 3), test_b = there(10, 4);
  const Model of_a = learnt(a), of_b = learnt(b);
  ASSERT_GT(apart_m(of_a, learnt(here(60, 5)), test_a), 0.01) << "or the test could not fail";
  for (const Model& together : {learnt(b, of_a), learnt(a, of_b)}) {
    EXPECT_NO_THROW(check(together));
    ASSERT_EQ(together.sites.size(), 2u);
    EXPECT_EQ(size(together), size(of_a) + size(of_b));
    EXPECT_LT(apart_m(together, of_a, test_a), 1e-9);
    EXPECT_LT(apart_m(together, of_b, test_b), 1e-9);
  }
}

TEST(Sites, LaterTracksOfOneLeaveTheOthersPaths) {
  const Tracks b = there(100, 2), test_a = here(10, 3);
  Model model = learnt(b, learnt(here(60, 1)));
  const Model before = model;
  model = learnt(there(60, 9), model);
  EXPECT_EQ(model.sites[1].episodes, 8);
  EXPECT_EQ(model.sites[0].episodes, 3);
  EXPECT_LT(apart_m(model, before, test_a), 1e-9);
  EXPECT_GT(apart_m(model, before, there(10, 4)), 0.01);
}

TEST(Sites, LearntByOneFleetPredictAboutAsByOneFleetEach) {
  const Tracks a = here(80, 1), b = there(80, 2);
  Tracks both = a;
  both.insert(both.end(), b.begin(), b.end());
  const auto by_fleet = [](const Tracks& tracks) {
    return learn_fleet({}, testing::partitions_of(tracks, 20, 20), kConfig);
  };
  const Model of_a = by_fleet(a), of_b = by_fleet(b), together = by_fleet(both);
  EXPECT_NO_THROW(check(together));
  ASSERT_EQ(together.sites.size(), 2u);
  for (const Site& site : together.sites) {
    EXPECT_EQ(site.tracks, 80);
    EXPECT_EQ(site.episodes, 4);
  }
  for (const std::size_t site : {0U, 1U}) EXPECT_FALSE(entry_of(together.refinement.error_statistics, site).empty());
  const Tracks test_a = here(30, 3), test_b = there(30, 4);
  EXPECT_NEAR(error_m(together, test_a), error_m(of_a, test_a), 0.05 * error_m(of_a, test_a));
  EXPECT_NEAR(error_m(together, test_b), error_m(of_b, test_b), 0.05 * error_m(of_b, test_b));
}

TEST(Sites, OfOneBatchAreLearntEachByItself) {
  const Tracks a = here(20, 1), b = there(20, 2);
  Tracks mixed;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mixed.push_back(a[i]);
    mixed.push_back(b[i]);
  }
  const Model model = run_episode({}, mixed, kConfig).model;
  EXPECT_NO_THROW(check(model));
  ASSERT_EQ(model.sites.size(), 2u);
  EXPECT_EQ(model.episodes, 1);
  const Model of_a = run_episode({}, a, kConfig).model, of_b = run_episode({}, b, kConfig).model;
  EXPECT_EQ(size(model), size(of_a) + size(of_b));
  EXPECT_LT(apart_m(model, of_a, here(10, 3)), 1e-9);
  EXPECT_LT(apart_m(model, of_b, there(10, 4)), 1e-9);
}

TEST(Sites, ABatchBetweenTwoOfThemCountsAtOne) {
  const auto at = [](double x_m, unsigned seed) {
    Tracks tracks = here(20, seed);
    for (FramedTrajectory& placed : tracks) placed.frame.origin_m.x() = x_m;
    return tracks;
  };
  const Model before = learnt(at(1.5, 2), learnt(at(0.0, 1)));
  const Model after = learnt(at(0.8, 3), before);
  ASSERT_EQ(after.sites.size(), 2U);
  int changed = 0;
  for (std::size_t site = 0; site < 2; ++site) {
    const double more = after.refinement.error_statistics[site].density[kWalking].scale.weight -
                        before.refinement.error_statistics[site].density[kWalking].scale.weight;
    changed += more != 0.0;
    EXPECT_EQ(more != 0.0, after.sites[site].tracks > before.sites[site].tracks);
  }
  EXPECT_EQ(changed, 1);
  // Both are near the site of another model, whose sums must then have the windows of all.
  const auto windows = [](const Model& model) {
    double sum = 0.0;
    for (const ErrorStatistics& statistics : model.refinement.error_statistics)
      sum += statistics.density[kWalking].scale.weight;
    return sum;
  };
  const Model between = learnt(at(0.75, 4));
  const Model fused = fuse_models(between, before, kConfig.fuse).model;
  ASSERT_EQ(fused.sites.size(), 1U);
  EXPECT_NEAR(windows(fused), windows(between) + windows(before), 1e-9 * windows(fused));
}

TEST(Sites, ThatAreSharedFuseAndSayWhereFrom) {
  EpisodeConfig shared = kConfig;
  shared.fuse.sites = SiteSharing::shared;
  const Model model = learnt(there(60, 2), learnt(here(60, 1), {}, shared), shared);
  EXPECT_NO_THROW(check(model));
  EXPECT_LT(size(model), size(learnt(there(60, 2), learnt(here(60, 1)))));
  EXPECT_TRUE(std::ranges::any_of(model.transitions, [](const Transition& t) { return t.sites.size() == 2; }));
  EXPECT_THROW(learnt(here(20, 6), model), std::invalid_argument);
}

TEST(Sites, WithoutTrainingGetTheGlobalPart) {
  const Model model = learnt(there(60, 2), learnt(here(60, 1)));
  Model nothing_but_global = model;
  nothing_but_global.primitives.clear();
  nothing_but_global.transitions.clear();
  Tracks elsewhere = here(10, 3);
  for (FramedTrajectory& placed : elsewhere) {
    for (Vector2& p : placed.track.positions_m) p.x() += 500.0;
    placed.frame.origin_m.x() += 500.0;
  }
  EXPECT_EQ(apart_m(model, nothing_but_global, elsewhere), 0.0);
  EXPECT_GT(model.refinement.error_statistics.front().correction.features.norm(), 0.0);
  EXPECT_EQ(pooled_error_statistics(model).correction.features.norm(), 0.0) << "positions of other sites mean nothing";
  const Predictor predictor(model, kConfig.predict);
  for (const Window& window : windows_of(elsewhere, kConfig.sampling, kConfig.predict, 2.0)) {
    const Prediction prediction = predictor.predict(window.observed);
    EXPECT_TRUE(prediction.fallback);
    EXPECT_FALSE(prediction.regions.empty()) << "what errors at all sites show";
  }
}

TEST(Sites, AreTheSameInMetresAndInWidths) {
  EpisodeConfig by_width = kConfig;
  by_width.scaling = CurbScaling::mean_width;
  Tracks tracks = here(60, 1), test = here(10, 3);
  const Model in_metres = learnt(tracks);
  const Predictor first(in_metres, kConfig.predict);
  const std::vector<Window> windows = windows_of(test, kConfig.sampling, kConfig.predict, 1.0);
  for (Tracks* some : {&tracks, &test}) {
    for (FramedTrajectory& placed : *some) placed.frame = testing::square_frame(2.0, CurbScaling::mean_width);
  }
  const Model in_widths = learnt(tracks, {}, by_width);
  ASSERT_EQ(size(in_metres), size(in_widths));
  for (std::size_t i = 0; i < in_metres.transitions.size(); ++i) {
    const Transition &a = in_metres.transitions[i], &b = in_widths.transitions[i];
    EXPECT_EQ(a.count, b.count);
    EXPECT_LT((a.field.gp.pseudo_inputs - 2.0 * b.field.gp.pseudo_inputs).norm(), 1e-9);
    const SparseGp &r = entry_of(in_metres.refinement.residuals, i), &s = entry_of(in_widths.refinement.residuals, i);
    EXPECT_LT((r.pseudo_inputs - 2.0 * s.pseudo_inputs).norm(), 1e-9);
  }
  const Predictor second(in_widths, kConfig.predict);
  const std::vector<Window> same = windows_of(test, kConfig.sampling, kConfig.predict, 1.0);
  double distance_m = 0.0;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const Prediction a = first.predict(windows[i].observed), b = second.predict(same[i].observed);
    distance_m += (mean_path(a, 25).back() - mean_path(b, 25).back()).norm() / static_cast<double>(windows.size());
  }
  EXPECT_LT(distance_m, 1e-15) << "a width of 2 m scales without rounding";
}

TEST(Sites, RejectAUnitThatIsNotThatOfTheScaling) {
  EpisodeConfig config = kConfig;
  config.reference_width_m = 3.0;
  EXPECT_THROW(run_episode({}, here(5, 1), config), std::invalid_argument);
  Tracks tracks = here(5, 1);
  for (FramedTrajectory& placed : tracks) placed.frame = testing::square_frame(2.0, CurbScaling::mean_width);
  EXPECT_THROW(run_episode({}, tracks, kConfig), std::invalid_argument);
}

/// Tracks and their frames, turned about the origin of the world.
Tracks turned(Tracks tracks, const Matrix2& rotation) {
  for (FramedTrajectory& placed : tracks) {
    for (Vector2* part : {&placed.frame.origin_m, &placed.frame.axis_1, &placed.frame.axis_2}) *part = rotation * *part;
    for (Vector2& p : placed.track.positions_m) p = rotation * p;
  }
  return tracks;
}

TEST(Sites, PredictTheSameInAnyAxesOfTheWorld) {
  const Matrix2 rotation = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  Tracks tracks = here(60, 1);
  for (std::size_t i = 0; i < tracks.size(); i += 2) {  // every second person stands before walking
    Trajectory& track = tracks[i].track;
    track.positions_m.insert(track.positions_m.begin(), 80, Vector2(track.positions_m.front()));
    for (std::size_t k = track.times_s.size(); k < track.positions_m.size(); ++k)
      track.times_s.push_back(0.1 * static_cast<double>(k));
  }
  const Tracks other = turned(tracks, rotation);
  const Model model = learnt(tracks), model_of_other = learnt(other);
  const Predictor predictor(model, kConfig.predict), of_other(model_of_other, kConfig.predict);
  const auto windows = windows_of(tracks, kConfig.sampling, kConfig.predict, 1.0);
  const auto other_windows = windows_of(other, kConfig.sampling, kConfig.predict, 1.0);
  int standing = 0;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Prediction a = predictor.predict(windows[w].observed), b = of_other.predict(other_windows[w].observed);
    standing += a.standing ? 1 : 0;
    ASSERT_EQ(a.modes.size(), b.modes.size());
    const std::vector<double> nearest = nearest_probabilities(a), other_nearest = nearest_probabilities(b);
    for (std::size_t m = 0; m < a.modes.size(); ++m) {
      EXPECT_NEAR(a.modes[m].weight, b.modes[m].weight, 1e-9);
      EXPECT_NEAR(nearest[m], other_nearest[m], 1e-9);
      EXPECT_LT((rotation * a.modes[m].path_m.back() - b.modes[m].path_m.back()).norm(), 1e-9);
      const Matrix2 covariance_m2 = rotation * a.modes[m].covariances_m2.back() * rotation.transpose();
      EXPECT_LT((covariance_m2 - b.modes[m].covariances_m2.back()).norm(), 1e-9);
    }
  }
  EXPECT_GT(standing, 100);
}

}  // namespace
}  // namespace sila
