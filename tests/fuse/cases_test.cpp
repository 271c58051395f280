#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "sila/core/errors.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/io/reports.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

const fs::path kOwnCases = fs::path(SILA_TESTS_DIR) / "cases" / "fuse";

std::vector<fs::path> case_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Runs every case of a folder; the number of cases.
std::size_t run_all(const fs::path& folder) {
  const std::vector<fs::path> files = case_files(folder);
  for (const fs::path& file : files) {
    const FusionCase example = read_fusion_case(file.string());
    for (const std::string& line : differences(example.expect, plan_fusion(example.problem, example.rules))) {
      ADD_FAILURE() << file.filename() << ": " << line;
    }
  }
  return files.size();
}

FusionCase own_case(const std::string& name) {
  return read_fusion_case((kOwnCases / (name + ".json")).string());
}

/// The message with which a case file is rejected.
std::string rejection(const std::string& text) {
  const tests::ScratchFolder folder;
  const fs::path path = folder.write("case.json", text);
  std::string message = "accepted";
  try {
    read_fusion_case(path.string());
  } catch (const FormatError& error) {
    message = error.what();
    EXPECT_EQ(error.path, path.string());
  }
  return message;
}

TEST(FusionCases, OwnExamplesComeOutExactly) {
  EXPECT_EQ(run_all(kOwnCases), 24u);
}

TEST(FusionCases, SharedExamplesComeOutExactly) {
  const char* folder = std::getenv("SILA_FUSION_CASES");
  const fs::path shared = folder != nullptr ? fs::path(folder) : fs::path(SILA_TESTS_DIR) / "../../shared/cases/fuse";
  if (!fs::is_directory(shared)) GTEST_SKIP() << "no folder " << shared;
  EXPECT_GE(run_all(shared), 13u);
}

TEST(FusionCases, EveryWrongResultIsFoundAndNamed) {
  const FusionCase example = own_case("e15_paper_figure");
  const FusionPlan plan = plan_fusion(example.problem, example.rules);
  ASSERT_EQ(example.expect.size(), 8u);
  for (const auto& [key, value] : example.expect.items()) {
    nlohmann::json wrong = example.expect;
    wrong[key] = key == "model_size" ? nlohmann::json(20) : nlohmann::json::array({1});
    const auto lines = differences(wrong, plan);
    ASSERT_EQ(lines.size(), 1u) << key;
    EXPECT_EQ(lines.front().rfind(key, 0), 0u) << lines.front();
  }
}

TEST(FusionCases, DifferencesSayWhatIsMissingAndWhatIsTooMuch) {
  const FusionCase example = own_case("e01_one_match");
  const FusionPlan plan = plan_fusion(example.problem, example.rules);
  nlohmann::json wrong = example.expect;
  wrong["in"][2] = 3;
  wrong["transitions"][1] = {3, 4, 2};
  wrong["model_size"] = 6;
  const std::vector<std::string> expected{"in of 3: expected 3, found 1", "model_size: expected 6, found 5",
                                          "transitions: missing [[3,4,2]], not expected [[1,4,2]]"};
  EXPECT_EQ(differences(wrong, plan), expected);
}

TEST(FusionCases, SetsMayBeListedInAnyOrder) {
  const FusionCase example = own_case("e15_paper_figure");
  nlohmann::json shuffled = example.expect;
  for (const char* key : {"fusion_set", "kept", "transitions", "groups"}) {
    std::reverse(shuffled[key].begin(), shuffled[key].end());
  }
  EXPECT_TRUE(differences(shuffled, plan_fusion(example.problem, example.rules)).empty());
}

TEST(FusionCases, AnExplainedFusionIsACaseThatComesOut) {
  for (const fs::path& file : case_files(kOwnCases)) {
    SCOPED_TRACE(file.string());
    const FusionCase example = read_fusion_case(file.string());
    const FusionPlan plan = plan_fusion(example.problem, example.rules);
    const auto explained = explain_fusion(example.name, example.problem, example.rules, plan);
    const tests::ScratchFolder folder;
    const FusionCase again = read_fusion_case(folder.write("explained.json", explained.dump(1)).string());
    EXPECT_EQ(again.expect, example.expect);
    EXPECT_TRUE(differences(again.expect, plan_fusion(again.problem, again.rules)).empty());
  }
}

TEST(FusionCases, ExplanationNamesTheReasonOfEachComponent) {
  const FusionCase example = own_case("e15_paper_figure");
  const auto reasons =
      explain_fusion("", example.problem, example.rules, plan_fusion(example.problem, example.rules))["reasons"];
  ASSERT_EQ(reasons.size(), 3u);
  EXPECT_EQ(reasons[0]["decisions"][0]["reason"].dump(), "\"one-to-one\"");
  EXPECT_EQ(reasons[0]["decisions"][0]["fused"].dump(), "[2,7]");
  EXPECT_EQ(reasons[1]["decisions"][0]["reason"].dump(), "\"case 1\"");
  EXPECT_EQ(reasons[1]["decisions"][0]["split"].dump(), "[4,9,10]");
  EXPECT_EQ(reasons[1]["decisions"][0]["leaf_similarity"].dump(), "0.15");
  EXPECT_EQ(reasons[2]["decisions"][0]["reason"].dump(), "\"case 2\"");
  EXPECT_EQ(reasons[2]["relaxed"].dump(), "[[5,13,0.71]]");
}

TEST(FusionCases, BrokenFilesAreRejectedWithThePlace) {
  EXPECT_TRUE(says(rejection(""), "found an empty file"));
  EXPECT_TRUE(says(rejection("{\n\"similarity\": [\n"), ".json:2: expected JSON"));
  EXPECT_TRUE(says(rejection("[1]"), R"(expected a JSON object, found "[1]")"));
  EXPECT_TRUE(
      says(rejection("{\"similarity_threshold\": 0.7}"), "previous_primitives = a whole number, found no such field"));
}

TEST(FusionCases, SenselessContentIsRejected) {
  const auto with = [](const std::string& similarity, const std::string& transitions, const std::string& more) {
    return rejection(
        R"({"similarity_threshold": 0.7, "previous_primitives": 2, "incoming_primitives": 2, "similarity": )" +
        similarity + R"(, "transitions": )" + transitions + more + "}");
  };
  const std::string expect = R"(, "expect": {"kept": [1, 2, 3, 4]})";
  EXPECT_EQ(with("[]", "[]", expect), "accepted");
  EXPECT_TRUE(says(with("[[1, 5, 0.8]]", "[]", expect), "does not exist"));
  EXPECT_TRUE(says(with("[[1, 1, 0.8]]", "[]", expect), "first must be below second"));
  EXPECT_TRUE(says(with("[[1, 3, 1.8]]", "[]", expect), "must be in [-1, 1]"));
  EXPECT_TRUE(says(with("[[1, 3, 0.8], [3, 1, 0.9]]", "[]", expect), "stands twice"));
  EXPECT_TRUE(says(with("[[1.5, 3, 0.8]]", "[]", expect), R"(found similarity = "[[1.5,3,0.8]]")"));
  EXPECT_TRUE(says(with("[[1, 3]]", "[]", expect), "[primitive, primitive, number]"));
  EXPECT_TRUE(says(with("[]", "[[1, 3, 1]]", expect), "must stay within one model"));
  EXPECT_TRUE(says(with("[]", "[[1, 2, 0]]", expect), "the count must be positive"));
  EXPECT_TRUE(says(with("[]", "[[0, 1, 1]]", expect), "does not exist"));
  EXPECT_TRUE(says(with("[]", "[]", ""), "found no such field"));
  EXPECT_TRUE(says(with("[]", "[]", R"(, "expect": {"keep": []})"), R"(found expect = "{"keep":[]}")"));
  EXPECT_TRUE(
      says(with("[]", "[]", expect + R"(, "options": {"strict": true})"), "options = an object of strict_relax"));
}

}  // namespace
}  // namespace sila
