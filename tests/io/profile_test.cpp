#include <gtest/gtest.h>

#include "sila/config.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using nlohmann::json;

TEST(Profile, DefaultIsTheDefaultConfigurationAndUndoesTheOthers) {
  EXPECT_EQ(to_json(with_profile({}, "default")), to_json(Config{}));
  for (const char* const name : kProfiles)
    EXPECT_EQ(to_json(with_profile(with_profile({}, name), "default")), to_json(Config{})) << name;
  EXPECT_EQ(to_json(with_profile(with_profile({}, "paper-literal"), "paper")), to_json(with_profile({}, "paper")));
}

TEST(Profile, OfThePaperHasNothingThatWeAdded) {
  for (const char* name : {"paper", "paper-literal"}) {
    const EpisodeConfig config = with_profile({}, name).episode;
    EXPECT_FALSE(config.residual.enabled || config.error_statistics.enabled || config.prune.enabled ||
                 config.predict.stacking);
  }
  EXPECT_EQ(with_profile({}, "paper-literal").episode.learn.field.outputs, FieldOutputs::independent);
  EXPECT_EQ(with_profile({}, "paper-literal").episode.fuse.gp.fusion, GpFusion::pseudo_data);
}

TEST(Profile, LeavesOtherFieldsAndYieldsToThoseBesideIt) {
  Config config;
  config.episode.predict.horizon_s = 2.4;
  config = read_config(config, json::parse(R"({"predict": {"merge_radius_m": 1.5}, "profile": "paper"})"), "c.json");
  EXPECT_EQ(config.episode.predict.horizon_s, 2.4);
  EXPECT_EQ(config.episode.predict.merge_radius_m, 1.5);
  EXPECT_TRUE(config.episode.predict.own_deviation);
}

TEST(ConfigOf, AModelIsThatByWhichItWasLearnt) {
  StoredModel stored;
  EXPECT_EQ(to_json(config_of(stored)), to_json(Config{}));
  stored.configuration = R"({"predict": {"horizon_s": 3}})";
  EXPECT_EQ(config_of(stored).episode.predict.horizon_s, 3.0);
  for (const char* text : {"", "nonsense", R"({"predict": {"horizn_s": 3}})"}) {
    stored.configuration = text;
    EXPECT_TRUE(says(message_of<FormatError>([&] { config_of(stored, "m.sila"); }), "m.sila: expected"));
  }
}

TEST(Profile, AnUnknownOneIsRejectedWithTheNearestName) {
  const auto expect_rejected = [](const json& name, const std::string& nearest) {
    EXPECT_TRUE(says(message_of<FormatError>([&] {
                       read_config({}, {{"profile", name}}, "c.json");
                     }),
                     "the nearest is " + nearest + ")"));
  };
  expect_rejected("papr", "paper");
  expect_rejected("paper_literal", "paper-literal");
  expect_rejected(3, "paper");
  EXPECT_THROW(with_profile({}, "fast"), std::invalid_argument);
}

}  // namespace
}  // namespace sila
