#include "sila/io/config_json.hpp"

#include <gtest/gtest.h>

#include "made_up_model.hpp"
#include "sila/config.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using nlohmann::json;

enum class Cut { aligned, border };
constexpr const char* kCutNames[] = {"aligned", "border"};

struct InnerConfig {
  double similarity_threshold = 0.7;
  int rounds = 10;
  Cut cut = Cut::aligned;
};

template <class Config, class Visitor>
requires std::is_same_v<std::remove_const_t<Config>, InnerConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("similarity_threshold", config.similarity_threshold, Range{0.0, 1.0, true}, "",
               "cosine at which two are one");
  visit.number("rounds", config.rounds, Range{1, 1000}, "", "at most so many");
  visit.choice("cut", config.cut, kCutNames, "where supports are cut");
}

struct OuterConfig {
  InnerConfig fuse;
  double horizon_s = 5.0;
  bool stacking = true;
  std::uint64_t seed = 1;
  double limit = std::numeric_limits<double>::infinity();
};

template <class Config, class Visitor>
requires std::is_same_v<std::remove_const_t<Config>, OuterConfig>
void fields(Config& config, Visitor&& visit) {
  visit.group("fuse", config.fuse);
  visit.number("horizon", config.horizon_s, Range{0.0, 60.0, true}, "s", "how far ahead");
  visit.flag("stacking", config.stacking, "whether kinematics are mixed in");
  visit.number("seed", config.seed, Range{0.0}, "", "of the random numbers");
  visit.number("limit", config.limit, Range{}, "m", "no farther than this");
}

std::string rejection(const json& given) {
  return message_of<FormatError>([&] { apply_json(OuterConfig{}, given, "c.json"); });
}

std::string rejection_to_set(const char* assignment) {
  return message_of<std::invalid_argument>([&] { set_field(OuterConfig{}, assignment); });
}

TEST(ConfigJson, WritesEveryFieldNestedAndInOrder) {
  EXPECT_EQ(
      to_json(OuterConfig{}).dump(),
      R"({"fuse":{"similarity_threshold":0.7,"rounds":10,"cut":"aligned"},"horizon":5.0,"stacking":true,"seed":1,"limit":"inf"})");
}

TEST(ConfigJson, ReadsBackWhatItWrote) {
  OuterConfig config;
  config.fuse = {0.1 + 0.2, 7, Cut::border};
  config.horizon_s = 1e-300;
  config.stacking = false;
  config.seed = 1ULL << 62U;
  config.limit = -std::numeric_limits<double>::infinity();
  const OuterConfig read = apply_json(OuterConfig{}, json::parse(to_json(config).dump()), "c.json");
  EXPECT_EQ(read.fuse.similarity_threshold, 0.1 + 0.2);
  EXPECT_EQ(read.fuse.rounds, 7);
  EXPECT_EQ(read.fuse.cut, Cut::border);
  EXPECT_EQ(read.horizon_s, 1e-300);
  EXPECT_FALSE(read.stacking);
  EXPECT_EQ(read.seed, 1ULL << 62U);
  EXPECT_EQ(read.limit, -std::numeric_limits<double>::infinity());
}

TEST(ConfigJson, WhatIsNotNamedStays) {
  OuterConfig config;
  config.horizon_s = 3.0;
  const OuterConfig read = apply_json(config, {{"fuse", {{"rounds", 3.0}}}}, "c.json");
  EXPECT_EQ(read.fuse.rounds, 3);
  EXPECT_EQ(read.horizon_s, 3.0);
  EXPECT_EQ(read.fuse.similarity_threshold, 0.7);
}

TEST(ConfigJson, DottedKeysAreGroups) {
  EXPECT_EQ(apply_json(OuterConfig{}, {{"fuse.rounds", 4}}, "c.json").fuse.rounds, 4);
}

TEST(ConfigJson, RejectsAnEarlierNameWithThePresentOne) {
  const auto expect_said = [](const json& given, const std::string& expected, const std::string& found) {
    EXPECT_EQ(message_of<FormatError>([&] { apply_json(Config{}, given, "c.json"); }),
              "c.json: expected " + expected + ", found \"" + found + "\"");
  };
  const auto expect_renamed = [&](const json& given, const std::string& found, const std::string& present) {
    expect_said(given, present + " (the new name of this field)", found);
  };
  expect_renamed({{"outlook", {{"knots", 3}}}}, "outlook", "residual");
  expect_renamed({{"predict.blend", false}}, "predict.blend", "predict.stacking");
  expect_renamed({{"learn", {{"field", {{"gp", {{"pseudo_inputs", "optimised"}}}}}}}}, "learn.field.gp", "learn.field");
  expect_renamed({{"compact", {{"enabled", false}}}}, "compact", "prune");
  expect_renamed({{"model", {{"max_bytes", 1e6}}}}, "model", "budget");
  expect_renamed({{"evaluate", {{"every_s", 1.0}}}}, "evaluate.every_s", "evaluate.stride_s");

  const std::string constant = "a field that can be set (this one is a constant now)";
  expect_said({{"predict", {{"leave_ratio", 0.5}}}}, constant, "predict.leave_ratio");
  expect_said({{"prune", {{"known_ratio", 0.5}}}}, constant, "prune.known_ratio");
  expect_said({{"predict", {{"alternative_weight", 0.01}}}}, constant, "predict.alternative_weight");
  expect_said({{"fleet.mean", "plain"}}, constant, "fleet.mean");
  for (const char* path : {"learn.dictionary.max_primitives", "learn.field.length_scale_m", "fuse.max_pseudo_inputs",
                           "prune.expire_after_episodes", "prune.half_life_episodes", "service.scored_pedestrians",
                           "service.max_track_samples"}) {
    expect_said({{path, 20}}, constant, path);
  }
}

TEST(ConfigJson, RejectsAnUnknownKeyWithTheNearest) {
  EXPECT_EQ(
      rejection({{"fuse", {{"similarity_treshold", 0.5}}}}),
      "c.json: expected a known field (the nearest is fuse.similarity_threshold), found \"fuse.similarity_treshold\"");
  EXPECT_TRUE(says(rejection({{"rounds", 5}}), "nearest is fuse.rounds"));  // the group was forgotten
  EXPECT_TRUE(says(rejection({{"horison", 5}}), "nearest is horizon)"));
  EXPECT_TRUE(says(rejection({{"", 5}}), "), found \"\""));
}

TEST(ConfigJson, RejectsValuesOfAnotherType) {
  EXPECT_EQ(rejection({{"horizon", "long"}}), "c.json: expected horizon to be a number, found \"long\"");
  EXPECT_EQ(rejection({{"fuse", {{"rounds", 2.5}}}}), "c.json: expected fuse.rounds to be a whole number, found 2.5");
  EXPECT_TRUE(says(rejection({{"stacking", 1}}), "stacking to be true or false, found 1"));
  EXPECT_TRUE(says(rejection({{"fuse", 3}}), "fuse to be an object, found 3"));
  EXPECT_TRUE(says(rejection({{"horizon", {{"s", 3}}}}), "horizon to be a number"));
  EXPECT_TRUE(says(rejection({{"horizon", nullptr}}), "horizon to be a number, found null"));
  EXPECT_TRUE(says(rejection({{"fuse", {{"cut", "diagonal"}}}}), "one of aligned | border, found \"diagonal\""));
  EXPECT_TRUE(says(rejection({{"fuse", {{"cut", 1}}}}), "one of aligned | border, found 1"));
  EXPECT_TRUE(says(rejection(json::array({1})), "a JSON object, found array"));
}

TEST(ConfigJson, RejectsValuesOutOfRange) {
  EXPECT_EQ(rejection({{"fuse", {{"similarity_threshold", 1.7}}}}),
            "c.json: expected fuse.similarity_threshold in (0, 1], found 1.7");
  EXPECT_TRUE(says(rejection({{"fuse", {{"similarity_threshold", 0.0}}}}), "in (0, 1], found 0"));
  EXPECT_TRUE(says(rejection({{"seed", -1}}), "seed in [0, inf), found -1"));
  EXPECT_TRUE(says(rejection({{"fuse", {{"rounds", 99999999999}}}}), "fuse.rounds in [1, 1000]"));
  EXPECT_TRUE(says(rejection({{"horizon", "inf"}}), "horizon in (0, 60], found inf"));
}

TEST(ConfigJson, SetsOneFieldFromTheCommandLine) {
  EXPECT_EQ(set_field(OuterConfig{}, "fuse.similarity_threshold=0.5").fuse.similarity_threshold, 0.5);
  EXPECT_EQ(set_field(OuterConfig{}, "fuse.cut=border").fuse.cut, Cut::border);
  EXPECT_FALSE(set_field(OuterConfig{}, "stacking=false").stacking);
  EXPECT_EQ(set_field(OuterConfig{}, "seed=77").seed, 77u);
  EXPECT_EQ(set_field(OuterConfig{}, "limit=1e3").limit, 1000.0);
}

TEST(ConfigJson, RejectsBadAssignments) {
  EXPECT_TRUE(says(rejection_to_set("horizon"), "expected path=value, found horizon"));
  EXPECT_TRUE(says(rejection_to_set("foo=1"), "`sila config` and sila.fields() list them), found \"foo\""));
  EXPECT_TRUE(says(rejection_to_set("horizont=1"), "the nearest is horizon), found \"horizont\""));
  EXPECT_TRUE(says(rejection_to_set("horizon="), "horizon to be a number, found \"\""));
  EXPECT_TRUE(says(rejection_to_set("horizon=5s"), "found \"5s\""));
  EXPECT_TRUE(says(rejection_to_set("horizon=nan"), "horizon in (0, 60], found nan"));
  EXPECT_TRUE(says(rejection_to_set("limit=nan"), "found nan"));
  EXPECT_TRUE(says(rejection_to_set("fuse.rounds=1e2"), "a whole number, found \"1e2\""));
  EXPECT_TRUE(says(rejection_to_set("fuse.rounds=0"), "in [1, 1000], found 0"));
  EXPECT_TRUE(says(rejection_to_set("fuse=1"), "expected a known field"));
  EXPECT_TRUE(says(rejection_to_set("stacking=yes"), "true or false, found \"yes\""));
}

TEST(ConfigJson, ListsEveryFieldWithDefaultUnitRangeAndText) {
  const std::vector<FieldInfo> list = list_fields(OuterConfig{});
  ASSERT_EQ(list.size(), 7u);
  EXPECT_EQ(list[0].path, "fuse.similarity_threshold");
  EXPECT_EQ(list[0].value, "0.7");
  EXPECT_EQ(list[0].range, "(0, 1]");
  EXPECT_EQ(list[2].range, "aligned | border");
  EXPECT_EQ(list[3].unit, "s");
  EXPECT_EQ(list[3].text, "how far ahead");
  EXPECT_EQ(list[4].range, "true | false");
  EXPECT_EQ(list[6].range, "any");
}

TEST(ConfigJson, TheTableIsAligned) {
  const std::vector<FieldInfo> list = {{"a.long_name", "1", "s", "[0, 1]", "first"}, {"b", "25", "", "any", "second"}};
  EXPECT_EQ(table(list),
            "field        value  unit  range   meaning\n"
            "a.long_name  1      s     [0, 1]  first\n"
            "b            25           any     second\n");
}

TEST(ConfigJson, ReadsJsonFilesWithCommentsAndNamesTheLineOfAnError) {
  const ScratchFolder folder;
  write_file(folder / "good.json", "{\n  // why\n  \"a\": 1\n}\n");
  EXPECT_EQ(read_json(folder / "good.json").at("a"), 1);
  write_file(folder / "bad.json", "{\n  \"a\": 1,\n  b\n}\n");
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder / "bad.json"); }), "bad.json:3: expected JSON"));
  write_file(folder / "cut.json", "{\n  \"a\": ");
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder / "cut.json"); }), "cut.json:2: expected JSON"));
  write_file(folder / "empty.json", "");
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder / "empty.json"); }), "expected a JSON text"));
  write_file(folder / "open.json", "{\n");
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder / "open.json"); }), "open.json:1: expected JSON"));
  write_file(folder / "big.json", R"({"a": 1e999})");
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder / "big.json"); }), "finite"));
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_json(folder.path()); }), "folder"));
}

}  // namespace
}  // namespace sila
