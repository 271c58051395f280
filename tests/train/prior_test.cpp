// A new place begins with what other places know of how people walk.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "refine/error_statistics.hpp"
#include "sila/config.hpp"
#include "sila/io/config_json.hpp"
#include "sila/model/packing.hpp"
#include "sila/refine/prune.hpp"
#include "sila/train/episode.hpp"
#include "sila/train/fleet.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

using testing::learnt;

using Tracks = std::vector<FramedTrajectory>;

const EpisodeConfig kConfig;

/// Around a corner far from the origin, turned.
Tracks elsewhere(int count, unsigned seed) {
  return testing::walks_at(make_curb_frame({300, -80}, {0, 1}, {-1, 0}, 3), count, seed);
}

/// Mean displacement error of the mean paths [m].
double error_m(const Model& model, const Tracks& tracks) {
  const Predictor predictor(model, kConfig.predict);
  double sum_m = 0.0;
  int steps = 0;
  for (const Window& window : windows_of(tracks, kConfig.sampling, kConfig.predict, 1.0)) {
    const std::vector<Vector2> path_m = mean_path(predictor.predict(window.observed), window.future_m.size());
    for (std::size_t j = 0; j < window.future_m.size(); ++j, ++steps) sum_m += (path_m[j] - window.future_m[j]).norm();
  }
  return sum_m / steps;
}

Model prior_elsewhere() {
  const Model other = learnt(elsewhere(80, 1));
  return make_prior(std::span(&other, 1));
}

TEST(Prior, HoldsTheSumsOfAllModelsWithoutPlaces) {
  const Model both[] = {learnt(elsewhere(20, 1)), learnt(testing::corner_walks(20, 2))};
  const Model prior = make_prior(both);
  EXPECT_TRUE(prior.empty());
  EXPECT_TRUE(prior.sites.empty());
  EXPECT_EQ(prior.episodes, 0);
  const ErrorStatistics &a = both[0].refinement.error_statistics[0], &b = both[1].refinement.error_statistics[0];
  EXPECT_EQ(windows_in(prior.refinement.prior.density), windows_in(a.density) + windows_in(b.density));
  EXPECT_TRUE(prior.refinement.prior.motion[0].features.isApprox(a.motion[0].features + b.motion[0].features));
  EXPECT_GT(a.correction.weight + b.correction.weight, 0.0);
  EXPECT_EQ(prior.refinement.prior.correction.features.norm(), 0.0);
  EXPECT_NO_THROW(check(prior));
}

TEST(Prior, CountsAPriorThatModelsShareOnce) {
  const Model shared = prior_elsewhere();
  const Model both[] = {learnt(testing::corner_walks(20, 2), shared), learnt(testing::corner_walks(20, 3), shared)};
  double windows = windows_in(shared.refinement.prior.density);
  for (const Model& model : both) windows += windows_in(model.refinement.error_statistics[0].density);
  EXPECT_DOUBLE_EQ(windows_in(make_prior(both).refinement.prior.density), windows);
}

TEST(Prior, HelpsWhereFewTracksAreKnown) {
  const Tracks unseen = testing::corner_walks(40, 9), few = testing::corner_walks(6, 3);
  const Model prior = prior_elsewhere();
  EXPECT_LT(error_m(learnt(few, prior), unseen), error_m(learnt(few), unseen));
}

TEST(Prior, CountsAtAPlaceLikeTwoHundredWindows) {
  const Model prior = prior_elsewhere();
  EXPECT_GT(windows_in(prior.refinement.prior.density), 300.0);
  const Model model = learnt(testing::corner_walks(20, 2), prior);
  const double own = windows_in(model.refinement.error_statistics[0].density);
  EXPECT_NEAR(windows_in(shrunk_error_statistics(model, 0).density), own + 200.0, 1e-6);
}

/// People who walk faster and faster, in any direction around a point.
Tracks speeding_up(const Vector2& around_m, int count) {
  Tracks tracks;
  for (int person = 0; person < count; ++person) {
    const double angle = 0.7 * person, speed_mps = 0.8 + 0.02 * (person % 10);
    FramedTrajectory placed{{"p" + std::to_string(person), {}, {}}, testing::square_frame()};
    placed.frame.origin_m = around_m;
    for (int i = 0; i <= 50; ++i) {
      const double t = 0.2 * i;
      placed.track.times_s.push_back(20.0 * person + t);
      placed.track.positions_m.push_back(around_m +
                                         (speed_mps * t + 0.05 * t * t) * Vector2(std::cos(angle), std::sin(angle)));
    }
    tracks.push_back(std::move(placed));
  }
  return tracks;
}

TEST(Prior, CountsWhereASiteHasNoErrorStatistics) {
  EpisodeConfig config;
  config.error_statistics.enabled = false;
  const Model prior = prior_elsewhere();
  const Tracks tracks = testing::corner_walks(40, 2), later = testing::corner_walks(20, 3);
  const Model model = learnt(tracks, prior, config);
  EXPECT_LT(error_m(model, later), error_m(prior, later));
  const Window window = windows_of(later, kConfig.sampling, kConfig.predict, 1.0).front();
  EXPECT_FALSE(Predictor(model, kConfig.predict).predict(window.observed).regions.empty());
}

TEST(Prior, CountsInTheErrorsOfAFleetAtANewSite) {
  const Partition here{testing::corner_walks(20, 2), 10, {}, {}};
  const auto errors = [&](const Model& start) {
    const Model model = learn_fleet(start, {here}, kConfig);
    return model.refinement.error_statistics.at(0).density[kWalking].scale.products;
  };
  EXPECT_FALSE(errors(prior_elsewhere()).isApprox(errors({}))) << "the model that predicts the first tracks knows it";
}

TEST(Prior, PredictsAtAPlaceWithoutTracksHowPeopleWalkElsewhere) {
  const Model other = learnt(speeding_up({100.0, 30.0}, 80)), prior = make_prior(std::span(&other, 1));
  const Tracks unseen = speeding_up({0.0, 0.0}, 15);
  EXPECT_LT(error_m(prior, unseen), 0.5 * error_m({}, unseen));
}

TEST(Prior, OfSimulatedPedestriansHelpsWhereFewTracksAreKnown) {
  Config elsewhere;
  elsewhere.simulate.layout = Layout::obtuse;
  elsewhere.simulate.tracks = 80;
  const Tracks tracks = simulated_tracks(elsewhere);
  const Model prior = simulated_prior({}).model;
  EXPECT_TRUE(prior.empty());
  EXPECT_EQ(prior.tracks, 0);
  const Tracks unseen(tracks.begin() + 40, tracks.end());
  for (const int known : {5, 20}) {
    const Tracks few(tracks.begin(), tracks.begin() + known);
    EXPECT_LT(error_m(learnt(few, prior), unseen), 0.97 * error_m(learnt(few), unseen)) << known;
  }
}

TEST(Prior, OfSimulatedPedestriansHasTheWindowsOfTheConfiguration) {
  Config config;
  config.episode.predict.horizon_s = 2.4;
  config.episode.predict.observe_s = 1.6;
  config.simulate.tracks = 5;
  const StoredModel prior = simulated_prior(config);
  EXPECT_EQ(prior.model.refinement.prior.steps, 12);
  EXPECT_DOUBLE_EQ(prior.model.refinement.prior.observe_s, 1.6);
  EXPECT_GT(windows_in(prior.model.refinement.prior.density), 1000.0) << "simulate.tracks has no effect";
  EXPECT_EQ(to_json(config_of(prior)), to_json(config));
  config.episode.error_statistics.enabled = false;
  EXPECT_THROW(simulated_prior(config), std::invalid_argument);
}

TEST(Prior, StaysAsItIsWhateverIsLearntAndFused) {
  const Model prior = prior_elsewhere();
  const Model first = learnt(testing::corner_walks(20, 3), prior), second = learnt(testing::corner_walks(20, 4), prior);
  EXPECT_EQ(pack(first.refinement.prior), pack(prior.refinement.prior));
  EXPECT_EQ(pack(fuse_models(first, second, kConfig.fuse).model.refinement.prior), pack(prior.refinement.prior));
  EXPECT_EQ(pack(fuse_models(learnt(testing::corner_walks(20, 5)), second, kConfig.fuse).model.refinement.prior),
            pack(prior.refinement.prior));
}

TEST(Prior, IsWhereAFleetBegins) {
  const Model prior = prior_elsewhere();
  const Model model = learn_fleet(prior, testing::partitions_of(testing::corner_walks(40, 3), 20, 20), kConfig);
  EXPECT_EQ(pack(model.refinement.prior), pack(prior.refinement.prior));
  EXPECT_EQ(model.tracks, 40);
  EXPECT_NO_THROW(check(model));
}

TEST(Prior, RejectsWhatDoesNotFit) {
  const Model model = learnt(testing::corner_walks(20, 3));
  EXPECT_THROW(make_prior(std::vector<Model>{model, model}), std::invalid_argument) << "its tracks would count twice";
  EXPECT_THROW(make_prior({}), std::invalid_argument);
  const Model nothing[1];
  EXPECT_THROW(make_prior(nothing), std::invalid_argument);
  EpisodeConfig shorter = kConfig;
  shorter.predict.horizon_s = 3.0;
  EXPECT_THROW(learnt(testing::corner_walks(20, 3), prior_elsewhere(), shorter), std::invalid_argument);
  const Model one = prior_elsewhere(), other = learnt(elsewhere(40, 6)), different = make_prior(std::span(&other, 1));
  EXPECT_THROW(fuse_models(learnt(testing::corner_walks(20, 3), one), learnt(testing::corner_walks(20, 4), different),
                           kConfig.fuse),
               std::invalid_argument);
}

}  // namespace
}  // namespace sila
