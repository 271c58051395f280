#include "sila/fuse/fuse.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <stdexcept>

#include "arrows.hpp"
#include "fuse/reindex.hpp"
#include "fuse/similarity.hpp"
#include "gp/fuse_gps.hpp"
#include "sila/io/fusion_case.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

FuseConfig with_threshold(double threshold) {
  FuseConfig config;
  config.similarity_threshold = threshold;
  return config;
}

bool same(const SparseGp& a, const SparseGp& b) {
  return a.kernel == b.kernel && a.noise_variance == b.noise_variance && a.pseudo_inputs == b.pseudo_inputs &&
         a.mean == b.mean && a.information == b.information && a.response == b.response &&
         a.mean_response == b.mean_response && a.points == b.points;
}

bool same(const FlowField& a, const FlowField& b) {
  return same(a.gp, b.gp) && a.extent.min() == b.extent.min() && a.extent.max() == b.extent.max();
}

bool same(const MotionPrimitive& a, const MotionPrimitive& b) {
  return a.weight == b.weight && std::equal(a.cells.begin(), a.cells.end(), b.cells.begin(), b.cells.end(),
                                            [](const CellVelocity& c, const CellVelocity& d) {
                                              return c.cell == d.cell && c.velocity == d.velocity;
                                            });
}

bool same(const Transition& a, const Transition& b) {
  return a.from == b.from && a.to == b.to && a.count == b.count && same(a.field, b.field);
}

/// Bit for bit, error statistics aside.
void expect_same(const Model& a, const Model& b) {
  EXPECT_TRUE(a.settings == b.settings);
  EXPECT_EQ(a.episodes, b.episodes);
  EXPECT_EQ(a.tracks, b.tracks);
  ASSERT_EQ(a.primitives.size(), b.primitives.size());
  ASSERT_EQ(a.transitions.size(), b.transitions.size());
  for (std::size_t p = 0; p < a.primitives.size(); ++p) EXPECT_TRUE(same(a.primitives[p], b.primitives[p])) << p;
  for (std::size_t t = 0; t < a.transitions.size(); ++t) EXPECT_TRUE(same(a.transitions[t], b.transitions[t])) << t;
}

/// A model with the given primitives and transitions from one to the other, each with samples of its own.
Increment increment_of(std::vector<MotionPrimitive> primitives, const std::vector<TransitionCount>& transitions,
                       std::uint64_t seed) {
  Random random(seed);
  Increment increment;
  increment.model.primitives = std::move(primitives);
  increment.model.episodes = 1;
  increment.model.sites = {{CurbFrame{}, 1, 1, {}, {}}};
  for (const TransitionCount& edge : transitions) {
    increment.samples.push_back(random_samples(random));
    increment.model.transitions.push_back(
        {edge.from, edge.to, edge.count, field_of(increment.samples.back()), {}, {{0, edge.count, 1}}});
  }
  return increment;
}

TransitionSamples both(const TransitionSamples& a, const TransitionSamples& b) {
  TransitionSamples all{Eigen::MatrixXd(2, a.positions.cols() + b.positions.cols()),
                        Eigen::MatrixXd(a.velocities.rows() + b.velocities.rows(), 2)};
  all.positions << a.positions, b.positions;
  all.velocities << a.velocities, b.velocities;
  return all;
}

/// The message of the std::invalid_argument that a call throws.
template <class Call>
std::string rejection(Call call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

const std::vector<MotionPrimitive> kTwoRows{row_of_arrows(0, 3), row_of_arrows(10, 13)};

TEST(Fuse, GivesValidModelsNoLargerThanAccumulating) {
  FuseReport seen;  // random models that never meet a case would test nothing
  for_seeds(100, [&seen](Random& random) {
    Increment batch = random_increment(random);
    FuseConfig config = with_threshold(uniform(random, 0.3, 1.0));
    config.split_credit = integer(random, 0, 1) == 1;
    Model model;
    for (int episode = 1; episode <= 4; ++episode) {
      const FuseResult fused = fuse(model, batch, config);
      EXPECT_NO_THROW(check(fused.model));
      EXPECT_LE(size(fused.model), size(accumulate(model, batch).model));
      EXPECT_EQ(total_count(fused.model), total_count(model) + total_count(batch.model) + fused.report.split_credit);
      EXPECT_EQ(total_points(fused.model), total_points(model) + total_points(batch.model));
      EXPECT_EQ(fused.model.episodes, episode);
      EXPECT_EQ(fused.model.tracks, model.tracks + batch.model.tracks);
      EXPECT_EQ(size(fused.model), fused.plan.model_size());
      seen.one_to_one += fused.report.one_to_one;
      seen.case_1 += fused.report.case_1;
      seen.case_2 += fused.report.case_2;
      seen.case_3 += fused.report.case_3;
      seen.relaxed += fused.report.relaxed;
      seen.refitted += fused.report.refitted;
      seen.fused += fused.report.fused;
      model = fused.model;
      batch = random_increment(random);
    }
  });
  for (const int often :
       {seen.one_to_one, seen.case_1, seen.case_2, seen.case_3, seen.relaxed, seen.refitted, seen.fused}) {
    EXPECT_GE(often, 20);
  }
}

TEST(Fuse, OfAModelWithItselfKeepsPrimitivesAndDoublesCounts) {
  for_seeds(50, [](Random& random) {
    Increment increment = random_increment(random);
    const Model model = increment.model;
    if (integer(random, 0, 1) == 1) increment.samples.clear();
    const Model fused = fuse(model, increment, with_threshold(1.0)).model;
    ASSERT_EQ(fused.primitives.size(), model.primitives.size());
    for (std::size_t p = 0; p < model.primitives.size(); ++p) {
      MotionPrimitive expected = model.primitives[p];
      expected.weight *= 2;
      EXPECT_TRUE(same(fused.primitives[p], expected));
    }
    ASSERT_EQ(fused.transitions.size(), model.transitions.size());
    for (std::size_t t = 0; t < model.transitions.size(); ++t) {
      EXPECT_EQ(fused.transitions[t].from, model.transitions[t].from);
      EXPECT_EQ(fused.transitions[t].to, model.transitions[t].to);
      EXPECT_EQ(fused.transitions[t].count, 2 * model.transitions[t].count);
    }
  });
}

TEST(Fuse, WithAThresholdThatNothingReachesEqualsAccumulating) {
  for_seeds(50, [](Random& random) {
    const Model previous = random_model(random);
    const Increment incoming = random_increment(random);
    const FuseResult accumulated = accumulate(previous, incoming);
    expect_same(fuse(previous, incoming, with_threshold(1.0)).model, accumulated.model);
    EXPECT_EQ(size(accumulated.model), size(previous) + size(incoming.model));
    EXPECT_EQ(static_cast<std::size_t>(accumulated.report.copied), accumulated.model.transitions.size());
  });
}

TEST(Fuse, GivesTheSameBytesOnOneThreadAndOnFour) {
  for_seeds(10, [](Random& random) {
    const Model previous = random_model(random);
    const Increment incoming = random_increment(random);
    const auto on_threads = [&](std::size_t threads) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      return fuse(previous, incoming, with_threshold(0.5)).model;
    };
    expect_same(on_threads(1), on_threads(4));
  });
}

TEST(Fuse, OfModelsWithoutSamplesTreatsBothAlike) {
  for_seeds(50, [](Random& random) {
    const Model a = random_model(random);
    const Model b = random_model(random);
    const FuseResult ab = fuse(a, {b, {}}, with_threshold(0.6));
    const FuseResult ba = fuse(b, {a, {}}, with_threshold(0.6));
    const auto weights = [](const Model& model) {
      std::multiset<double> result;
      for (const MotionPrimitive& primitive : model.primitives) result.insert(primitive.weight);
      return result;
    };
    const auto counts = [](const Model& model) {
      std::multiset<double> result;
      for (const Transition& transition : model.transitions) result.insert(transition.count);
      return result;
    };
    EXPECT_EQ(weights(ab.model), weights(ba.model));
    EXPECT_EQ(counts(ab.model), counts(ba.model));
    EXPECT_EQ(ab.plan.splits.size(), ba.plan.splits.size());
  });
}

TEST(Fuse, LooksUpAllSimilaritiesThatThePlanNeeds) {
  for_seeds(100, [](Random& random) {
    const Model previous = random_model(random);
    const Increment incoming = random_increment(random);
    const FuseResult fused = fuse(previous, incoming, with_threshold(uniform(random, 0.2, 0.8)));
    std::vector<MotionPrimitive> all = previous.primitives;
    all.insert(all.end(), incoming.model.primitives.begin(), incoming.model.primitives.end());
    FusionProblem complete = fused.problem;
    complete.similarities.clear();
    for (std::size_t a = 0; a < all.size(); ++a) {
      for (std::size_t b = a + 1; b < all.size(); ++b) {
        complete.similarities.push_back({static_cast<int>(a), static_cast<int>(b), similarity(all[a], all[b])});
      }
    }
    FusionRules rules;
    rules.split_credit = true;
    EXPECT_TRUE(differences(to_case_json(plan_fusion(complete, rules)), fused.plan).empty());
  });
}

TEST(Fuse, FirstEpisodeGivesTheModelOfTheIncrement) {
  Random random(1);
  const Increment first = random_increment(random);
  expect_same(fuse(Model{}, first).model, first.model);
}

TEST(Fuse, AnEmptyIncrementChangesNothingButTheCounters) {
  Random random(2);
  Model previous = random_model(random);
  Increment nothing;
  nothing.model.episodes = 1;
  nothing.model.tracks = 5;
  nothing.model.settings.grid.cell = 7.0;  // never used, so it does not matter
  const Model fused = fuse(previous, nothing).model;
  previous.episodes += 1;
  previous.tracks += 5;
  expect_same(fused, previous);
}

TEST(Fuse, JoinsSitesAndAddsTheirErrorStatistics) {
  Random random(3);
  Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.model.sites[0].frame.origin_m = {100.0, 0.0};
  previous.sites[0].error_statistics = incoming.model.sites[0].error_statistics = zero_error_statistics(2, 0.2, 3.2);
  previous.sites[0].error_statistics.novelties[3] = 1.0, incoming.model.sites[0].error_statistics.novelties[3] = 2.0;
  const Model apart = fuse(previous, incoming).model;
  ASSERT_EQ(apart.sites.size(), 2u);
  EXPECT_EQ(apart.sites[0].error_statistics.novelties[3], 1.0);
  EXPECT_EQ(apart.sites[1].error_statistics.novelties[3], 2.0);
  EXPECT_EQ(apart.sites[1].tracks, incoming.model.tracks);
  const Model one = fuse(apart, incoming).model;
  ASSERT_EQ(one.sites.size(), 2u);
  EXPECT_EQ(one.sites[1].error_statistics.novelties[3], 4.0);
  EXPECT_EQ(one.sites[1].episodes, 2);
  EXPECT_EQ(one.sites[0].episodes, 1);
  incoming.model.sites[0].error_statistics = zero_error_statistics(4, 0.2, 3.2);
  EXPECT_THROW(fuse(previous, incoming), std::invalid_argument);
}

TEST(Fuse, OfSitesThatAreApartIsAsAccumulating) {
  for_seeds(30, [](Random& random) {
    const Model here = random_model(random);
    Increment elsewhere = random_increment(random);
    elsewhere.model.sites[0].frame.origin_m = {100.0, 0.0};
    const FuseConfig config = with_threshold(uniform(random, 0.3, 0.9));
    const Model apart = fuse(here, elsewhere, config).model;
    expect_same(apart, accumulate(here, elsewhere).model);
    check(apart);
    // Each site goes on as if the other were not there.
    const Increment more = random_increment(random);
    EXPECT_EQ(size(fuse(apart, more, config).model), size(fuse(here, more, config).model) + size(elsewhere.model));
  });
}

TEST(Fuse, KeepsCountsBySiteWhateverFuses) {
  int of_both = 0;
  for_seeds(50, [&](Random& random) {
    FuseConfig config = with_threshold(uniform(random, 0.3, 0.9));
    config.sites = SiteSharing::shared;
    config.split_credit = integer(random, 0, 1) == 1;
    Model model;
    double by_site[2] = {0.0, 0.0}, credit = 0.0;
    for (int episode = 0; episode < 6; ++episode) {
      Increment batch = random_increment(random);
      batch.model.sites[0].frame.origin_m.x() = 100.0 * (episode % 2);
      by_site[episode % 2] += total_count(batch.model);
      const FuseResult fused = fuse(model, batch, config);
      credit += fused.report.split_credit;
      model = fused.model;
      check(model);
    }
    double left[2] = {0.0, 0.0};
    for (const Transition& transition : model.transitions) {
      for (const SiteCount& part : transition.sites) left[part.site] += part.count;
      of_both += transition.sites.size() == 2;
    }
    EXPECT_EQ(left[0] + left[1], by_site[0] + by_site[1] + credit);
    if (credit == 0.0) {
      EXPECT_EQ(left[0], by_site[0]);
    }
  });
  EXPECT_GT(of_both, 20);
}

TEST(Fuse, CannotPartSitesThatAreShared) {
  Random random(4);
  FuseConfig shared;
  shared.sites = SiteSharing::shared;
  const Model here = random_model(random);
  Increment elsewhere = random_increment(random);
  EXPECT_NO_THROW(fuse(fuse(here, elsewhere, shared).model, elsewhere));  // of one site
  elsewhere.model.sites[0].frame.origin_m = {100.0, 0.0};
  const Model both = fuse(here, elsewhere, shared).model;
  EXPECT_NE(rejection([&] { fuse(both, elsewhere); }).find("keep fuse.sites = shared"), std::string::npos);
  EXPECT_NO_THROW(fuse(fuse(here, elsewhere).model, elsewhere, shared));
}

TEST(Fuse, ReplacesAPrimitiveByItsTwoHalves) {
  const std::vector<MotionPrimitive> halves{row_of_arrows(1, 2), row_of_arrows(3, 4)};
  const Model previous = increment_of(halves, {{0, 1, 4}}, 1).model;
  const Increment incoming = increment_of({row_of_arrows(1, 4), row_of_arrows(9, 12)}, {{0, 1, 1}, {1, 0, 2}}, 2);
  const FuseResult fused = fuse(previous, incoming, with_threshold(0.7));
  ASSERT_EQ(fused.report.case_1, 1);
  ASSERT_EQ(fused.model.primitives.size(), 3u);
  EXPECT_TRUE(same(fused.model.primitives[0], halves[0]));
  EXPECT_TRUE(same(fused.model.primitives[1], halves[1]));
  ASSERT_EQ(fused.model.transitions.size(), 3u);
  const Transition& between = fused.model.transitions[0];
  EXPECT_EQ(std::pair(between.from, between.to), std::pair(0, 1));
  EXPECT_EQ(between.count, 4 + 2);  // two came to the split primitive, one left it
  EXPECT_EQ(fused.report.split_credit, 2.0);
  EXPECT_EQ(std::pair(fused.model.transitions[1].from, fused.model.transitions[1].to), std::pair(1, 2));
  EXPECT_EQ(std::pair(fused.model.transitions[2].from, fused.model.transitions[2].to), std::pair(2, 0));
  EXPECT_EQ(fuse(previous, incoming, with_threshold(0.71)).report.case_1, 0);  // 1/sqrt(2) is below
}

TEST(Fuse, TakesSamplesInPlaceOfTheGpsThatWereTrainedOnThem) {
  const Increment first = increment_of(kTwoRows, {{0, 1, 3}}, 3);
  const Increment second = increment_of(kTwoRows, {{0, 1, 2}}, 4);
  const FuseResult fused = fuse(first.model, second);
  ASSERT_EQ(fused.report.fused, 1);
  const SparseGp& old = first.model.transitions[0].field.gp;
  const std::vector<const SparseGp*> parts{&old};
  const GpData data{second.samples[0].positions, second.samples[0].velocities};
  const SparseGp expected = fuse_gps(parts, data, GpConfig{}, Hyperparameters{old.kernel, old.noise_variance});
  EXPECT_TRUE(same(fused.model.transitions[0].field.gp, expected));
  EXPECT_EQ(fused.model.transitions[0].count, 5.0);
}

TEST(Fuse, WithoutSamplesFusesBothStoredGps) {
  const Increment first = increment_of(kTwoRows, {{0, 1, 3}}, 3);
  const Increment second = increment_of(kTwoRows, {{0, 1, 2}}, 4);
  const FuseResult fused = fuse(first.model, {second.model, {}});
  const std::vector<const SparseGp*> parts{&first.model.transitions[0].field.gp, &second.model.transitions[0].field.gp};
  const GpData none{Eigen::MatrixXd(2, 0), Eigen::MatrixXd(0, 2)};
  EXPECT_TRUE(same(fused.model.transitions[0].field.gp, fuse_gps(parts, none, GpConfig{})));
}

TEST(Fuse, FitsATransitionOfTheIncrementAloneToItsPooledSamples) {
  // Both incoming rows are fused into the first previous one (case 2), so their two transitions become one.
  const Model previous = increment_of({row_of_arrows(0, 3)}, {}, 5).model;
  const Increment incoming =
      increment_of({row_of_arrows(0, 3), row_of_arrows(0, 2), row_of_arrows(10, 13)}, {{0, 2, 1}, {1, 2, 2}}, 6);
  const FuseResult fused = fuse(previous, incoming);
  ASSERT_EQ(fused.report.case_2, 1);
  ASSERT_EQ(fused.report.refitted, 1);
  ASSERT_EQ(fused.model.transitions.size(), 1u);
  const TransitionSamples pooled = both(incoming.samples[0], incoming.samples[1]);
  EXPECT_TRUE(same(fused.model.transitions[0].field, field_of(pooled)));
  EXPECT_EQ(fused.model.transitions[0].count, 3.0);
}

TEST(Fuse, AsksTheCallerForModelsOfOneKind) {
  Random random(7);
  const Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.model.settings.grid.cell = 2.5;
  const std::string message = rejection([&] { fuse(previous, incoming); });
  EXPECT_NE(message.find("fuse: settings of previous = {cell 1, "), std::string::npos) << message;
  EXPECT_NE(message.find("incoming = {cell 2.5, "), std::string::npos) << message;
  EXPECT_NE(rejection([&] { accumulate(previous, incoming); }).find("accumulate: settings"), std::string::npos);
}

TEST(Fuse, AsksForSamplesThatBelongToTheTransitions) {
  Random random(8);
  const Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.samples[0].velocities.resize(1, 2);
  EXPECT_NE(rejection([&] { fuse(previous, incoming); }).find("they must be 2 x n and n x 2"), std::string::npos);
  incoming.samples.pop_back();
  EXPECT_NE(rejection([&] { fuse(previous, incoming); }).find("one for each of the"), std::string::npos);
}

TEST(FuseConfig, NamesTheFieldThatIsOutOfRange) {
  EXPECT_EQ(rejection([] { validate(with_threshold(1.7)); }), "fuse: similarity_threshold = 1.7 is outside (0, 1]");
  EXPECT_EQ(rejection([] { fuse({}, {}, with_threshold(0.0)); }), "fuse: similarity_threshold = 0 is outside (0, 1]");
  FuseConfig config;
  config.gp.alpha = 2.0;
  EXPECT_EQ(rejection([&] { validate(config); }), "gp: alpha = 2 is outside [0, 1]");
  EXPECT_EQ(rejection([] { validate(FuseConfig{}); }), "accepted");
}

TEST(FuseConfig, DefaultsFollowTheDocumentedReading) {
  const FuseConfig config;
  EXPECT_TRUE(config.both_directions && config.split_credit);
  EXPECT_FALSE(config.strict_relax || config.literal_self_transitions || config.case_3_fuses_stronger);
  EXPECT_FALSE(FusionRules{}.split_credit);  // of worked examples
}

}  // namespace
}  // namespace sila
