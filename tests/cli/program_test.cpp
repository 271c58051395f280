#include "program.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

namespace sila::tests {
namespace {

TEST_F(Program, LearnsPredictsAndEvaluatesASimulatedIntersection) {
  learn();
  const auto inspected = json_of("inspect m.sila --json");
  EXPECT_EQ(inspected.at("tracks"), 60);
  EXPECT_EQ(inspected.at("episodes"), 3);
  EXPECT_EQ(inspected.at("size").get<int>(),
            inspected.at("primitives").get<int>() + inspected.at("transitions").get<int>());
  EXPECT_EQ(inspected.at("bytes").get<std::uintmax_t>(), fs::file_size(folder_ / "m.sila"));
  ASSERT_EQ(run("predict tracks.csv --scene tracks.scene.json --model m.sila --out p.ndjson").code, 0);
  const std::string all = "--every 5 --outcomes --explain --digits 6 --out all.ndjson";  // of one line
  ASSERT_EQ(run("predict tracks.csv --scene tracks.scene.json --model m.sila " + all).code, 0);
  EXPECT_TRUE(says(content_of(folder_ / "all.ndjson"), "explanation"));
  const Outcome evaluated = run("evaluate tracks.csv --scene tracks.scene.json --model m.sila --json");
  const auto groups = nlohmann::json::parse(evaluated.out).at("groups");
  EXPECT_GT(groups.at("moving").at("windows").get<int>(), 50);
  EXPECT_EQ(groups.at("all").at("horizons").size(), 5u);
}

TEST_F(Program, LearnsAndPredictsWithoutAScene) {
  simulate();
  ASSERT_EQ(run("learn tracks.csv --model m.sila").code, 0);
  ASSERT_EQ(run("predict tracks.csv --model m.sila --out p.ndjson").code, 0);
  const Outcome shown = run("scene show m.sila");
  ASSERT_EQ(shown.code, 0) << shown.err;
  folder_.write("shown.json", shown.out);
  ASSERT_EQ(run("predict tracks.csv --scene shown.json --model m.sila --out q.ndjson").code, 0);
  EXPECT_EQ(content_of(folder_ / "p.ndjson"), content_of(folder_ / "q.ndjson"));
  EXPECT_EQ(run("learn tracks.csv --model m.sila").out, run("learn tracks.csv --scene shown.json --model m.sila").out);
  EXPECT_EQ(run("scene show m.sila").out, shown.out);
  for (const char* verb : {"learn", "predict", "evaluate"}) {
    expect_rejected(std::string(verb) + " tracks.csv --scene tracks.scene.json --model m.sila",
                    {"tracks.scene.json", "leave the scene out"});
  }
}

TEST_F(Program, PredictsFromRealSamplesOnlyAndKeepsTheContractOfALine) {
  learn();
  const Outcome outcome = run("predict tracks.csv --scene tracks.scene.json --model m.sila --every 0.7");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::map<std::string, std::set<double>> stamps;
  std::istringstream rows(content_of(folder_ / "tracks.csv"));
  std::string row;
  std::getline(rows, row);
  while (std::getline(rows, row)) {
    const auto comma = row.find(',');
    stamps[row.substr(0, comma)].insert(std::stod(row.substr(comma + 1)));
  }
  std::istringstream lines(outcome.out);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto prediction = nlohmann::json::parse(line);
    const std::string track = prediction.at("track");
    EXPECT_TRUE(stamps.at(track).contains(prediction.at("t0").get<double>())) << line.substr(0, 80);
    EXPECT_EQ(prediction.at("t").size(), 25u);
    double sum = 0.0;
    for (const auto& mode : prediction.at("modes")) {
      sum += mode.at("weight").get<double>();
      EXPECT_EQ(mode.at("x").size(), 25u);
      EXPECT_EQ(mode.at("y").size(), 25u);
      EXPECT_EQ(mode.at("cov").size(), 25u);
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    EXPECT_LE(prediction.at("modes").size(), 8u);
  }
  EXPECT_GT(count, 100);
}

TEST_F(Program, LearnsTheSameInCoordinatesOfAMap) {
  simulate();
  std::istringstream rows(content_of(folder_ / "tracks.csv"));
  std::ostringstream moved;
  std::string id, t, x, y;
  std::getline(rows, id);
  moved << id << std::fixed << "\n";
  while (std::getline(rows, id, ',') && std::getline(rows, t, ',') && std::getline(rows, x, ',') &&
         std::getline(rows, y))
    moved << id << "," << t << "," << std::stod(x) + 691600.0 << "," << std::stod(y) + 5334700.0 << "\n";  // UTM
  folder_.write("utm.csv", moved.str());
  const auto error_of = [&](const std::string& tracks) {
    const Outcome learnt = run("learn " + tracks + " --model " + tracks + ".sila");
    EXPECT_EQ(learnt.code, 0) << learnt.err;
    const auto score = json_of("evaluate " + tracks + " --json --model " + tracks + ".sila");
    return score.at("groups").at("moving").at("horizons").back().at("model").at("ade_m").get<double>();
  };
  EXPECT_NEAR(error_of("utm.csv"), error_of("tracks.csv"), 1e-3);  // rows have six decimals
}

TEST_F(Program, NeverExceedsACapAndSaysWhatItGaveUp) {
  simulate();
  const Outcome outcome =
      run("learn tracks.csv --scene tracks.scene.json --model m.sila --json --set budget.max_primitives=25 "
          "--set budget.max_bytes=400000");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto inspected = json_of("inspect m.sila --json");
  EXPECT_LE(inspected.at("primitives").get<int>(), 25);
  EXPECT_LE(inspected.at("model_bytes").get<double>(), 400000.0);
  const auto evicted = nlohmann::json::parse(outcome.out).at("evicted");
  EXPECT_GT(evicted.at("primitives").get<int>(), 0);
  EXPECT_GT(evicted.at("transitions").get<int>(), 0);
  EXPECT_GT(evicted.at("count").get<double>(), 0.0);
  EXPECT_TRUE(says(outcome.err, "over the limit, evicted"));
}

TEST_F(Program, RejectsCapsTooSmallForAModelAndLeavesTheFileAlone) {
  learn();
  const std::string model = content_of(folder_ / "m.sila");
  for (const std::string field : {"budget.max_bytes=1000", "budget.max_bytes=0", "budget.max_bytes=-5",
                                  "budget.max_primitives=0", "budget.max_primitives=nan"}) {
    const std::string rejected = "learn tracks.csv --scene tracks.scene.json --model m.sila --batch 30 --set " + field;
    expect_rejected(rejected, {field.substr(0, field.find('='))});
    EXPECT_EQ(run(rejected).code, field == "budget.max_bytes=1000" ? 1 : 2) << field;  // what fits depends on the model
    EXPECT_EQ(content_of(folder_ / "m.sila"), model) << field;
  }
}

TEST_F(Program, TheSameInputAndSeedGiveTheSameBytes) {
  learn();
  fs::rename(folder_ / "m.sila", folder_ / "first.sila");
  const std::string tracks = content_of(folder_ / "tracks.csv");
  learn();
  EXPECT_EQ(content_of(folder_ / "tracks.csv"), tracks);
  const std::string predict = "predict tracks.csv --scene tracks.scene.json --threads ";
  const std::string predicted = run(predict + "1 --model first.sila").out;
  EXPECT_TRUE(says(predicted, "modes"));
  EXPECT_EQ(predicted, run(predict + "2 --model m.sila").out);
}

TEST_F(Program, GoesOnWithAModelAndFusesTwo) {
  learn();
  const std::string again = "learn tracks.csv --scene tracks.scene.json --model ";
  const Outcome second = run(again + "m.sila --batch 30");
  ASSERT_EQ(second.code, 0);
  EXPECT_TRUE(says(second.err, "warning: the model has learnt at least 60 of the first 60 tracks in other batches"));
  EXPECT_EQ(json_of("inspect m.sila --json").at("episodes"), 5);
  ASSERT_EQ(run(again + "n.sila --batch 25").code, 0);
  const Outcome fused = run("fuse m.sila n.sila --out both.sila --explain why.json");
  ASSERT_EQ(fused.code, 0) << fused.err;
  EXPECT_EQ(fused.err, "");
  ASSERT_EQ(run("simulate --tracks 40 --seed 2 --out other.csv").code, 0);
  for (const char* name : {"tracks", "other"})
    ASSERT_EQ(run(std::string("learn ") + name + ".csv --model " + name + ".sila").code, 0);
  EXPECT_TRUE(says(run("fuse tracks.sila other.sila --out two.sila").err,
                   "warning: nothing was fused, as one frame or both were made from tracks"));
  EXPECT_EQ(json_of("inspect both.sila --json").at("tracks"), 180);
  fs::create_directory(folder_ / "cases");
  fs::rename(folder_ / "why.json", folder_ / "cases" / "why.json");
  EXPECT_EQ(run("fuse --cases cases").code, 0);  // what it explains is a case that it passes
}

TEST_F(Program, LearnsNoBatchTwice) {
  learn();
  const std::string model = content_of(folder_ / "m.sila");
  const Outcome again = run("learn tracks.csv --scene tracks.scene.json --model m.sila --batch 20");
  EXPECT_EQ(again.code, 0);
  EXPECT_TRUE(says(again.err, "3 of 3 batches are in m.sila already"));
  EXPECT_EQ(content_of(folder_ / "m.sila"), model);
  expect_rejected("fuse m.sila m.sila --out twice.sila", {"have learnt 3 episodes"});
}

TEST_F(Program, SaysWhereTheFleetIs) {
  expect_rejected("fleet sites --model m.sila", {"pip install"});
  expect_rejected("experiment e.json --out out", {"pip install"});
}

TEST_F(Program, RunsCasesAndSaysWhichFail) {
  fs::copy(fs::path(SILA_TESTS_DIR) / "cases" / "fuse", folder_ / "cases");
  EXPECT_EQ(run("fuse --cases cases").code, 0);
  for (const auto& entry : fs::directory_iterator(folder_ / "cases")) {
    nlohmann::json wrong = nlohmann::json::parse(content_of(entry.path()));
    wrong["expect"]["model_size"] = 999;
    folder_.write("cases" / entry.path().filename(), wrong.dump());
    break;
  }
  const Outcome failed = run("fuse --cases cases");
  EXPECT_EQ(failed.code, 1);
  EXPECT_TRUE(says(failed.out, "FAIL"));
}

TEST_F(Program, PrintsEveryConfigurationValueAndItsVersion) {
  const Outcome config = run("config");
  EXPECT_EQ(config.code, 0);
  for (const char* path :
       {"fuse.similarity_threshold", "learn.grid.cell_m", "predict.horizon_s", "simulate.noise_std_m"}) {
    EXPECT_TRUE(says(config.out, path));
  }
  folder_.write("c.json", run("config --json").out);
  EXPECT_EQ(run("config --config c.json").out, config.out);
  for (const char* verb : {"simulate", "learn", "predict", "evaluate", "fuse", "inspect", "config"}) {
    EXPECT_TRUE(says(run(std::string(verb) + " --help").out, "Example"));
  }
}

TEST_F(Program, PrintsVersionAndRevisionAndWritesThemToModelsAndReports) {
  const std::string version = run("--version").out;
  const std::regex form("sila [0-9]+\\.[0-9]+\\.[0-9]+ \\(([0-9a-f]{8,}\\+?|unknown revision)\\)\n");
  EXPECT_TRUE(std::regex_match(version, form)) << version;
  learn();
  for (const std::string command : {"inspect m.sila", "inspect m.sila --json", "report m.sila --json",
                                    "evaluate tracks.csv --scene tracks.scene.json --model m.sila --json"})
    EXPECT_TRUE(says(run(command).out, version.substr(5, version.size() - 6)));
}

TEST_F(Program, TakesAProfileFromTheCommandLineOrAFile) {
  folder_.write("paper.json", R"({"profile": "paper", "predict": {"max_modes": 3}})");
  const auto configured = [&](const std::string& options) { return json_of("config --json " + options); };
  nlohmann::json paper = configured("--profile paper");
  EXPECT_NE(paper, configured("--profile paper-literal"));
  paper["predict"]["max_modes"] = 3;
  EXPECT_EQ(configured("--config paper.json"), paper);
  EXPECT_EQ(configured("--profile paper --set predict.max_modes=3"), paper);
  nlohmann::json usual = configured("");
  usual["predict"]["max_modes"] = 3;
  EXPECT_EQ(configured("--profile default --config paper.json"), usual);
  expect_rejected("config --profile papr", {"papr", "the nearest is paper"});
}

/// The JSON inside a report.
nlohmann::json data_of(const std::string& page) {
  const std::string begin = "<script id=\"data\" type=\"application/json\">";
  const std::size_t from = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST_F(Program, ReportsAModelItsEpisodesAndItsPredictions) {
  learn();
  ASSERT_EQ(run("report m.sila tracks.csv --scene tracks.scene.json --out r.html").code, 0);
  const nlohmann::json data = data_of(content_of(folder_ / "r.html"));
  EXPECT_EQ(data.at("episodes").size(), 3u);
  EXPECT_EQ(data.at("model").at("tracks"), 60);
  EXPECT_FALSE(data.at("played").empty());
  std::size_t primitives = 0;
  for (const auto& episode : data.at("episodes")) {
    const auto& change = episode.at("statistics").at("change");
    EXPECT_EQ(change.at("before"), primitives);
    primitives = change.at("after");
  }
  EXPECT_EQ(primitives, data.at("model").at("primitives").size());
  EXPECT_FALSE(data_of(run("report m.sila").out).contains("played"));
  EXPECT_EQ(run("report m.sila tracks.csv --scene tracks.scene.json --threads 1").out, content_of(folder_ / "r.html"));
}

TEST_F(Program, ReportsAnExperimentAndRejectsWhatIsNone) {
  folder_.write("results.json", R"({"version": "0", "curves": []})");
  EXPECT_TRUE(data_of(run("report results.json").out).contains("results"));
  folder_.write("other.json", "{}");
  expect_rejected("report other.json", {"other.json", "sila experiment"});
  expect_rejected("report missing.sila", {"missing.sila"});
}

}  // namespace
}  // namespace sila::tests
