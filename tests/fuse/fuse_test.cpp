#include "sila/fuse/fuse.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "fuse/steps.hpp"
#include "fuse_data.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"
#include "support/message_of.hpp"
#include "support/random_models.hpp"

namespace sila {
namespace {

TEST(Fuse, GivesValidModelsNoLargerThanAccumulating) {
  FuseCounts seen;  // random models that never meet a case would test nothing
  for_seeds(100, [&seen](Random& random) {
    Increment batch = random_increment(random);
    FuseConfig config = with_threshold(uniform(random, 0.3, 1.0));
    config.split_credit = integer(random, 0, 1) == 1;
    Model model;
    for (int episode = 1; episode <= 4; ++episode) {
      const FuseResult fused = fuse(model, batch, config);
      const FuseCounts counts = counts_of(fused.plan, model, batch);
      EXPECT_NO_THROW(check(fused.model));
      EXPECT_LE(size(fused.model), size(accumulate(model, batch).model));
      EXPECT_EQ(total_count(fused.model), total_count(model) + total_count(batch.model) + counts.split_credit);
      EXPECT_EQ(total_points(fused.model), total_points(model) + total_points(batch.model));
      EXPECT_EQ(fused.model.episodes, episode);
      EXPECT_EQ(fused.model.tracks, model.tracks + batch.model.tracks);
      EXPECT_EQ(size(fused.model), fused.plan.model_size());
      seen.one_to_one += counts.one_to_one;
      seen.case_1 += counts.case_1;
      seen.case_2 += counts.case_2;
      seen.case_3 += counts.case_3;
      seen.relaxed += counts.relaxed;
      seen.refitted += counts.refitted;
      seen.fused += counts.fused;
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
    EXPECT_TRUE(identical(fuse(previous, incoming, with_threshold(1.0)).model, accumulated.model));
    EXPECT_EQ(size(accumulated.model), size(previous) + size(incoming.model));
    const FuseCounts counts = counts_of(accumulated.plan, previous, incoming);
    EXPECT_EQ(static_cast<std::size_t>(counts.copied), accumulated.model.transitions.size());
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
    EXPECT_TRUE(identical(on_threads(1), on_threads(4)));
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
    EXPECT_TRUE(differences(to_case_json(plan_fusion(complete, {.split_credit = true})), fused.plan).empty());
  });
}

TEST(Fuse, FirstEpisodeGivesTheModelOfTheIncrement) {
  Random random(1);
  const Increment first = random_increment(random);
  EXPECT_TRUE(identical(fuse(Model{}, first).model, first.model));
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
  EXPECT_TRUE(identical(fused, previous));
}

TEST(Fuse, AsksTheCallerForModelsOfOneKind) {
  Random random(7);
  const Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.model.settings.grid.cell = 2.5;
  const std::string message = message_of([&] { fuse(previous, incoming); });
  EXPECT_TRUE(says(message, "fuse: the models have different settings: grid.cell = 1 and 2.5; "));
  EXPECT_TRUE(
      says(message_of([&] { accumulate(previous, incoming); }), "accumulate: the models have different settings"));
}

TEST(Fuse, AsksForSamplesThatBelongToTheTransitions) {
  Random random(8);
  const Model previous = random_model(random);
  Increment incoming = random_increment(random);
  incoming.samples[0].outputs.resize(1, 2);
  EXPECT_TRUE(says(message_of([&] { fuse(previous, incoming); }), "they must be 2 x n and n x 2"));
  incoming.samples.pop_back();
  EXPECT_TRUE(says(message_of([&] { fuse(previous, incoming); }), "one for each of the"));
}

TEST(FuseConfig, NamesTheFieldThatIsOutOfRange) {
  EXPECT_EQ(message_of([] { validate(with_threshold(1.7)); }), "fuse: similarity_threshold = 1.7 is outside (0, 1]");
  EXPECT_EQ(message_of([] { fuse({}, {}, with_threshold(0.0)); }), "fuse: similarity_threshold = 0 is outside (0, 1]");
  FuseConfig config;
  config.gp.selection_stop = 2.0;
  EXPECT_EQ(message_of([&] { validate(config); }), "gp: selection_stop = 2 is outside [0, 1]");
  EXPECT_EQ(message_of([] { validate(FuseConfig{}); }), "");
}

TEST(FuseConfig, DefaultsFollowTheDocumentedReading) {
  const FuseConfig config;
  EXPECT_TRUE(config.both_directions && config.split_credit);
  EXPECT_FALSE(config.strict_relax || config.literal_self_transitions || config.case_3_fuses_stronger);
  EXPECT_FALSE(FusionRules{}.split_credit);  // of worked examples
}

}  // namespace
}  // namespace sila
