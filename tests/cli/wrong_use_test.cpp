#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "program.hpp"

// What the program does with wrong options, wrong files and full disks.
namespace sila::tests {
namespace {

TEST_F(Program, OnAFullDiskSaysSoAndKeepsWhatItHad) {
  simulate();
  const std::string learn = "learn tracks.csv --scene tracks.scene.json --model m.sila --batch ";
  const std::string full = "trap '' XFSZ; ulimit -f 64; ";  // no file over 32 KB
  const Outcome nothing = run(learn + "20", full);
  EXPECT_EQ(nothing.code, 1) << nothing.err;
  EXPECT_TRUE(says(nothing.err, "m.sila: expected a model file that can be written"));
  EXPECT_TRUE(says(nothing.err, "is the disk full?"));
  ASSERT_EQ(run(learn + "20").code, 0);  // what was begun there is no hindrance
  const std::string before = run("inspect m.sila --json").out;
  EXPECT_EQ(nlohmann::json::parse(before).at("episodes"), 3);
  const Outcome more = run(learn + "15", full);
  EXPECT_EQ(more.code, 1) << more.err;
  EXPECT_TRUE(says(more.err, "m.sila: expected a model file that can be written"));
  EXPECT_EQ(run("inspect m.sila --json").out, before);
  EXPECT_EQ(run(learn + "15").code, 0);
  ASSERT_EQ(run("replay tracks.csv --rate 1e6 > lines.ndjson").code, 0);
  const std::string serve = "serve --stdin --wait --http off --scene tracks.scene.json --model s.sila --every 10 ";
  const Outcome served = run(serve + "< lines.ndjson", full);
  EXPECT_EQ(served.code, 1) << served.err;
  EXPECT_TRUE(says(served.err, "sila: serve: 3 episodes failed"));
}

TEST_F(Program, SaysThatStandardOutputIsFull) {
  learn();
  const Outcome outcome = run("predict tracks.csv --scene tracks.scene.json --model m.sila > /dev/full");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_TRUE(says(outcome.err, "standard output"));
}

TEST_F(Program, WritesOverNoFileThatItReadsAndOverNoHistory) {
  learn();
  const std::string model = content_of(folder_ / "m.sila"), tracks = content_of(folder_ / "tracks.csv");
  const std::string with = " tracks.csv --scene tracks.scene.json --model m.sila";
  fs::create_symlink(folder_ / "m.sila", folder_ / "link.sila");
  for (const char* out : {"m.sila", "./m.sila", "link.sila", "tracks.csv", "tracks.scene.json"})
    expect_rejected("predict" + with + " --out " + out, {"--out", "name another file"});
  for (const char* verb : {"predict --model m.sila", "scene edit"})
    expect_rejected(std::string(verb) + " --scene tracks.scene.json --out tracks.csv",
                    {"the file of tracks.scene.json", "name another file"}, 2);
  folder_.write("own.scene.json", "{}");
  expect_rejected("simulate --tracks 5 --out own.csv", {"own.scene.json", "would be lost"});
  EXPECT_EQ(content_of(folder_ / "own.scene.json"), "{}");
  folder_.write("real.csv", tracks);
  expect_rejected("simulate --tracks 5 --out real.csv", {"real.csv", "would be lost"}, 1);
  EXPECT_EQ(content_of(folder_ / "real.csv"), tracks);
  EXPECT_FALSE(fs::exists(folder_ / "real.scene.json"));
  expect_rejected("simulate --tracks 5 --out .", {"found a folder"}, 1);
  for (const char* out : {"-", "/dev/stdout"})
    expect_rejected(std::string("simulate --tracks 5 --out ") + out, {"expected a file"}, 2);
  expect_rejected("scene edit real.csv --out tracks.scene.json", {"tracks.scene.json is a JSON file"}, 1);
  expect_rejected("report m.sila --out m.sila", {"name another file"});
  expect_rejected("scene edit tracks.csv --out tracks.csv", {"name another file"});
  expect_rejected("fuse m.sila m.sila --out f.sila --explain f.sila", {"--explain", "name another file"});
  expect_rejected("learn" + with + " --min-people 3 --share m.sila", {"name another file"});
  fs::copy(folder_ / "m.sila", folder_ / "other.sila");
  expect_rejected("learn" + with + " --min-people 3 --share other.sila", {"3 recorded episodes"});
  expect_rejected("learn" + with + " --min-people 3 --share no/s.sila", {"no folder"});
  ASSERT_EQ(run("learn" + with + " --min-people 3 --share shared.sila").code, 0);
  ASSERT_EQ(run("learn" + with + " --min-people 4 --share shared.sila").code, 0) << "a newer copy replaces the older";
  for (const char* verb : {"prior make m.sila", "fuse m.sila link.sila"}) {
    expect_rejected(std::string(verb) + " --out other.sila", {"3 recorded episodes"});
    expect_rejected(std::string(verb) + " --out shared.sila", {"60 tracks"});
  }
  ASSERT_EQ(run("simulate --tracks 40 --seed 2 --out new.csv").code, 0);
  ASSERT_EQ(run("learn new.csv --scene new.scene.json --model n.sila").code, 0);
  expect_rejected("predict" + with + " --out other.sila", {"other.sila is a model, which would be lost"}, 1);
  expect_rejected("simulate --out other.sila", {"other.sila is a model, which would be lost"}, 1);
  expect_rejected("fuse m.sila n.sila --out f.sila --explain other.sila", {"other.sila is a model"}, 1);
  expect_rejected("fuse m.sila n.sila --out f.sila --explain no/e.json", {"no/e.json", "no folder"}, 1);
  EXPECT_FALSE(fs::exists(folder_ / "f.sila"));
  expect_rejected("learn tracks.csv --scene '' --model m.sila", {"--scene", "an empty one"});
  EXPECT_EQ(run("predict" + with + " --out /dev/null").code, 0);
  EXPECT_EQ(content_of(folder_ / "m.sila"), model);
  EXPECT_EQ(content_of(folder_ / "other.sila"), model);
  EXPECT_EQ(content_of(folder_ / "tracks.csv"), tracks);
}

TEST_F(Program, ExitsWithTwoForAWrongCommandLineAndWithOneForBadInput) {
  learn();
  fs::copy(folder_ / "m.sila", folder_ / "copy.sila");
  folder_.write("two.csv", "track_id,t,x,y\n1,0,1,2\n1,0.5,1,2.5\n");
  folder_.write("wrong.json", R"({"fuse": {"similarity_threshold": 7}})");
  folder_.write("off.json", R"({"error_statistics": {"enabled": false}})");
  for (const char* wrong_command : {"",
                                    "lern",
                                    "--foo",
                                    "scene foo",
                                    "learn tracks.csv",
                                    "learn --model n.sila",
                                    "fuse m.sila",
                                    "fleet x",
                                    "rollback m.sila",
                                    "config --set fuse.similarity_threshold=7",
                                    "config --set nonsense=1",
                                    "config --profile x",
                                    "simulate --layout foo --out s.csv",
                                    "simulate --tracks 0 --out s.csv",
                                    "inspect ''",
                                    "learn tracks.csv --format foo --model n.sila",
                                    "learn tracks.csv tracks.csv --model n.sila",
                                    "learn tracks.csv --batch 0 --model n.sila",
                                    "learn tracks.csv --min-people 3 --model n.sila",
                                    "learn tracks.csv --camera c.json --metres-per-unit 2 --model n.sila",
                                    "learn tracks.csv --units pixels --scene s"
                                    " --model n.sila",
                                    "predict tracks.csv --model m.sila --horizon 0",
                                    "replay tracks.csv --rate 1e9 --to nowhere",
                                    "serve --http 1:2:x --model n.sila",
                                    "serve --http off --model n.sila",
                                    "serve --batch 0 --model n.sila",
                                    "report m.sila --picture p.png",
                                    "report m.sila --hold-out 0.3",
                                    "prior make m.sila --profile paper --out p.sila"})
    expect_rejected(wrong_command, {"sila: "}, 2);
  for (const char* bad_input :
       {"learn nowhere.csv --model n.sila", "learn --scene nowhere.json --model n.sila", "inspect tracks.csv",
        "rollback m.sila --to 99", "fuse m.sila copy.sila --out f.sila", "prior make m.sila copy.sila --out p.sila",
        "scene make two.csv", "config --config wrong.json", "config --config nowhere.json",
        "learn tracks.csv --scene tracks.scene.json --model m.sila --set sampling.interval_s=0.1",
        "predict tracks.csv --scene tracks.scene.json --model m.sila --observe 30", "prior make m.sila --out copy.sila",
        "evaluate two.csv --model m.sila --predictions two.csv", "serve --token-file no.txt --model m.sila",
        "prior make --config off.json --out p.sila"})
    expect_rejected(bad_input, {"sila: "}, 1);
  EXPECT_TRUE(says(run("--help").out, "Exit codes: 0 done; 1 bad input"));
}

TEST_F(Program, NamesTheSettingThatDoesNotFitAModel) {
  learn();
  const std::string with = " tracks.csv --scene tracks.scene.json --model ";
  const std::string again = "learn" + with + "m.sila --batch 15 --set ";
  expect_rejected(again + "predict.horizon_s=3", {"predict.horizon_s", "= 3, but the model began with 5"}, 1);
  for (const char* verb : {"predict", "evaluate", "report"})
    expect_rejected((verb == std::string("report") ? "report m.sila tracks.csv" : verb + with + "m.sila") +
                        " --set sampling.interval_s=0.4",
                    {"sampling.interval_s = 0.4, but the model began with 0.2"}, 1);
  ASSERT_EQ(run("simulate --tracks 60 --seed 2 --out other.csv").code, 0);
  ASSERT_EQ(run("learn other.csv --scene tracks.scene.json --model second.sila").code, 0);
  for (const std::string& verb : {"learn" + with + "m.sila", "predict" + with + "m.sila", "evaluate" + with + "m.sila",
                                  std::string("fuse m.sila second.sila --out f.sila")})
    expect_rejected(verb + " --set scaling=mean_width", {"scaling = mean_width, but the model began with metres"}, 1);
  for (const char* verb :
       {"learn other.csv --scene tracks.scene.json --model m.sila", "fuse m.sila second.sila --out f.sila"})
    expect_rejected(verb + std::string(" --set learn.field.outputs=independent"),
                    {"learn.field.outputs = independent, but the model began with shared"}, 1);
  ASSERT_EQ(run("learn other.csv --scene other.scene.json --model fine.sila --set sampling.interval_s=0.1 --set "
                "learn.grid.cell_m=2")
                .code,
            0);
  for (const char* verb : {"diff m.sila fine.sila", "fuse m.sila fine.sila --out f.sila"})
    expect_rejected(verb, {"sampling.interval_s = 0.2 and 0.1"}, 1);
  EXPECT_FALSE(says(run("diff m.sila fine.sila").err, "scaling")) << "that is equal";
  expect_rejected("prior make m.sila fine.sila --out p.sila",
                  {"sampling.interval_s = 0.2, predict", "found those of sampling.interval_s = 0.1"}, 1);
  expect_rejected("prior make --profile paper --out p.sila", {"error_statistics.enabled = false"}, 2);
  expect_rejected("prior make --seed 3 --out p.sila", {"--seed", "no effect"}, 2);
  expect_rejected("config --set =", {"expected path=value"}, 2);
}

TEST_F(Program, WarnsOfTracksThatTeachNothingAndOfTracksThatWereLearnt) {
  learn();
  const std::string with = " tracks.csv --scene tracks.scene.json";
  const std::string learnt = "warning: the model has learnt at least 60 of these 60 tracks";
  for (const std::string& verb : {"evaluate --model m.sila" + with, "report m.sila" + with})
    EXPECT_TRUE(says(run(verb).err, learnt));
  const Outcome part = run("learn --model part.sila --hold-out 0.3" + with);
  ASSERT_EQ(part.code, 0);
  EXPECT_TRUE(says(part.err, "--hold-out: 18 tracks held back, "));
  EXPECT_FALSE(says(run("evaluate --model part.sila --hold-out 0.3" + with).err, "warning"));
  folder_.write("two.csv", "track_id,t,x,y\n1,0,1,2\n1,0.5,1,2.5\n");
  EXPECT_TRUE(says(run("learn two.csv --model t.sila").err, "warning: no motion was learnt"));
  EXPECT_TRUE(says(run("inspect t.sila").out, "not calibrated"));
  folder_.write("empty.csv", "");
  expect_rejected("learn tracks.csv empty.csv --model n.sila", {"empty.csv: expected a file with rows"}, 1);
  EXPECT_NE(run("inspect n.sila").code, 0) << "nothing was learnt before the empty file was found";
}

TEST_F(Program, WarnsOfTracksOfAnotherPlace) {
  learn();
  const std::string warning = "warning: the tracks lie ";
  folder_.write("far.csv", "track_id,t,x,y\n1,0,500000,5400000\n1,0.5,500000,5400000.6\n1,1,500000,5400001\n");
  for (const char* model : {"m.sila", "new.sila"}) {
    const Outcome far = run(std::string("learn far.csv --scene tracks.scene.json --model ") + model);
    EXPECT_EQ(far.code, 0);
    EXPECT_TRUE(says(far.err, warning + "5423.1 km from "));
  }
  for (const char* learn : {"tracks.csv --batch 30 --model m.sila", "far.csv --model own.sila"})
    EXPECT_FALSE(says(run(std::string("learn ") + learn).err, warning)) << learn;
  EXPECT_TRUE(says(run("predict tracks.csv --model own.sila").err, warning + "5423.1 km from "));
}

TEST_F(Program, ReportsEachRejectedLineOfItsInput) {
  std::string lines = R"({"t": 1, "id": "a", "x": 1, "y": 1})"
                      "\n";
  for (int i = 0; i < 30; ++i) lines += "nonsense\n";
  lines += R"({"t": 2, "id": "a", "x": 1, "y": 1e300})"
           "\n";
  folder_.write("lines.ndjson", lines);
  const Outcome outcome = run("serve --stdin --wait --http off --model s.sila < lines.ndjson");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::map<std::string, int> rejected;
  std::istringstream answers(outcome.out);
  for (std::string line; std::getline(answers, line);) {
    const auto answer = nlohmann::json::parse(line);
    if (answer.contains("rejected")) rejected[answer.at("rejected")] += answer.at("count").get<int>();
  }
  EXPECT_EQ(rejected, (std::map<std::string, int>{{"not_json", 30}, {"not_usable", 1}}));
  EXPECT_TRUE(says(outcome.err, "standard input: {\"rejected\":\"not_json\""));
  EXPECT_TRUE(says(outcome.err, "the service reads NDJSON (docs/service.md), such as `sila replay TRACKS` writes"));
  EXPECT_EQ(outcome.err.find("not_json"), outcome.err.rfind("not_json")) << "only the first report of a kind";
}

TEST_F(Program, RejectsOptionsWithoutEffect) {
  learn();
  const std::string with = " tracks.csv --scene tracks.scene.json --model m.sila ";
  for (const char* arguments :
       {"serve --model m.sila --wait", "serve --model m.sila --mqtt-out a", "serve --model m.sila --http off",
        "predict tracks.csv --model m.sila --json", "simulate --out s.csv --json", "inspect m.sila --seed 1",
        "log m.sila --set a=1", "replay tracks.csv --linger 3"})
    expect_rejected(arguments, {"sila: "});
  expect_rejected("predict" + with + "--hold-out 0.5", {"--hold-out"});
  expect_rejected("learn" + with + "--split track", {"--split requires --hold-out"});
  expect_rejected("evaluate" + with + "--hold-out 0.5 --split banana", {"expected time or track, found banana"});
  expect_rejected("learn" + with + "--hold-out 0.99", {"--hold-out holds back all tracks"});
}

TEST_F(Program, ScoresPredictionsOfTheseTracksAlone) {
  learn();
  const std::string with = " tracks.csv --scene tracks.scene.json --model m.sila ";
  ASSERT_EQ(run("predict" + with + "--out p.ndjson").code, 0);
  const std::string evaluate = "evaluate" + with + "--predictions ";
  EXPECT_FALSE(says(run(evaluate + "p.ndjson").err, "warning"));
  const std::string lines = content_of(folder_ / "p.ndjson");
  const std::string others = std::regex_replace(lines, std::regex(R"("track":")"), R"("track":"other )");
  folder_.write("others.ndjson", others + lines.substr(0, lines.find('\n') + 1));
  folder_.write("some.ndjson", lines + others.substr(0, others.find('\n') + 1));
  folder_.write("none.ndjson", "");
  ASSERT_EQ(run("predict" + with + "--horizon 2 --out short.ndjson").code, 0);
  expect_rejected(evaluate + "short.ndjson", {"short.ndjson", "--set predict.horizon_s=2"}, 1);
  EXPECT_EQ(run(evaluate + "short.ndjson --set predict.horizon_s=2").code, 0);
  ASSERT_EQ(run("predict" + with + "--no-covariances --out means.ndjson").code, 0);
  expect_rejected(evaluate + "means.ndjson", {"means.ndjson:1: expected", "--no-covariances"}, 1);
  expect_rejected(evaluate + "none.ndjson", {"none.ndjson", "predictions of these tracks"});
  expect_rejected(evaluate + "others.ndjson", {"others.ndjson", "predictions of these tracks", "without a sample"});
  const Outcome some = run(evaluate + "some.ndjson");
  EXPECT_EQ(some.code, 0) << some.err;
  EXPECT_TRUE(says(some.err, "warning: some.ndjson: 1 of "));
}

TEST_F(Program, TellsThePeopleOfSeveralFilesApart) {
  learn();
  fs::create_directories(folder_ / "other");
  fs::copy_file(folder_ / "tracks.csv", folder_ / "other/tracks.csv");
  const std::string with = " tracks.csv other/tracks.csv --scene tracks.scene.json --model m.sila ";
  const Outcome predicted = run("predict" + with + "--out p.ndjson");
  ASSERT_EQ(predicted.code, 0) << predicted.err;
  EXPECT_TRUE(says(content_of(folder_ / "p.ndjson"), R"("track":"other/tracks:)"));
  const Outcome scored = run("evaluate" + with + "--predictions p.ndjson");
  EXPECT_EQ(scored.code, 0) << scored.err;
  EXPECT_FALSE(says(scored.err, "without a sample"));
}

TEST_F(Program, RejectsTracksOfWhichNoWindowCanBeScored) {
  learn();
  folder_.write("short.csv", "track_id,t,x,y\n1,0,0,0\n1,0.5,0,0.6\n1,1,0,1.2\n");
  expect_rejected("evaluate short.csv --scene tracks.scene.json --model m.sila",
                  {"no window can be scored; 1 track: a track must last at least 3.2 s", "predict.horizon_s"}, 1);
}

TEST_F(Program, SaysHowManyPredictionsAreFallbacks) {
  learn();
  folder_.write("far.csv", "track_id,t,x,y\n1,0,900,900\n1,0.5,900,900.6\n1,1,900,901.2\n");
  const Outcome far = run("predict far.csv --scene tracks.scene.json --model m.sila --every 0.5");
  EXPECT_TRUE(says(far.err, "2 predictions for 1 track; 2 of them without flow fields (fallback)"));
}

TEST_F(Program, RejectsContradictingFieldsBeforeItReadsTracks) {
  for (const std::string verb : {"learn nowhere.csv --model m.sila", "config"}) {
    expect_rejected(verb + " --set reference_width_m=2", {"reference_width_m = 2", "scaling = mean_width"});
    expect_rejected(verb + " --set scaling=mean_width --set reference_width_m=0.05",
                    {"reference_width_m = 0.05", "0.1"});
  }
}

TEST_F(Program, RejectsBadInputInOneSentenceAndLeavesTheModelAsItWas) {
  learn();
  const std::string before = content_of(folder_ / "m.sila");
  folder_.write("empty.csv", "");
  folder_.write("binary.csv", std::string("\x00\x01\xff\xfe\x00PNG", 8));
  folder_.write("header.csv", "track_id,t,x,y\n");
  folder_.write("nan.csv", "track_id,t,x,y\na,0,nan,1\na,1,nan,1\n");
  folder_.write("absurd.csv", "track_id,t,x,y\na,0,1e300,1\na,1,1e300,1\n");
  folder_.write("prose.txt", "It was a dark and stormy night.\nNobody walked.\n");
  const std::string learn_with = " --scene tracks.scene.json --model m.sila";
  expect_rejected("learn missing.csv" + learn_with, {"missing.csv"});
  for (const char* file : {"empty.csv", "binary.csv", "header.csv", "nan.csv", "absurd.csv", "prose.txt"}) {
    expect_rejected(std::string("learn ") + file + learn_with, {file, "expected"});
  }
  const auto scene = nlohmann::json::parse(content_of(folder_ / "tracks.scene.json"));
  const auto spoilt = [&](const char* name, auto change) {
    nlohmann::json wrong = scene;
    wrong.erase("corners");
    change(wrong);
    folder_.write(name, wrong.dump());
  };
  spoilt("no_axes.json", [](auto& s) { s.erase("axis_1"); });
  spoilt("parallel.json", [](auto& s) { s["axis_2"] = s["axis_1"]; });
  spoilt("no_width.json", [](auto& s) { s["sidewalk_width_m"] = 0; });
  spoilt("no_file.json", [](auto& s) { s["files"][0]["path"] = "nowhere.csv"; });
  const std::string model = " --model m.sila";
  expect_rejected("learn tracks.csv --scene no_axes.json" + model, {"no_axes.json", "axis_1"});
  expect_rejected("learn tracks.csv --scene parallel.json" + model, {"parallel.json", "axis"});
  expect_rejected("learn tracks.csv --scene no_width.json" + model, {"no_width.json", "sidewalk_width_m"});
  expect_rejected("learn --scene no_file.json" + model, {"nowhere.csv"});
  expect_rejected("learn --scene missing.json" + model, {"missing.json"});
  expect_rejected("learn tracks.csv --scene tracks.scene.json --model no/such/folder/m.sila", {"no/such/folder"});
  expect_rejected("learn tracks.csv --scene tracks.scene.json --model tracks.csv", {"tracks.csv"});
  const std::string predict_with = "predict tracks.csv --scene tracks.scene.json --model m.sila ";
  expect_rejected(predict_with + "--horizon 0", {"horizon"});
  expect_rejected(predict_with + "--observe 30", {"predict.observe_s = 30, the model uses at most 3.2 s"});
  expect_rejected("serve --stdin --model m.sila --set sampling.interval_s=0.1", {"sampling.interval_s = 0.1, but"}, 1);
  expect_rejected(predict_with + "--horizon -3", {"horizon"});
  expect_rejected(predict_with + "--every 0", {"--every: expected a positive number, found 0"});
  expect_rejected(predict_with + "--out no/such/folder/p.ndjson", {"no/such/folder"});
  expect_rejected("predict tracks.csv --scene tracks.scene.json --model missing.sila", {"missing.sila"});
  expect_rejected("predict tracks.csv --scene tracks.scene.json --model m.sila --outcomes=9", {"outcomes was given"});
  expect_rejected("learn tracks.csv" + learn_with + " --set fuse.similarity_threshold=1.7",
                  {"similarity_threshold", "1.7"});
  expect_rejected("learn tracks.csv" + learn_with + " --set fuse.similarity_treshold=0.5",
                  {"similarity_treshold", "fuse.similarity_threshold"});
  expect_rejected("learn tracks.csv" + learn_with + " --set learn.grid.cell_m=3", {"cell_m"});
  expect_rejected("learn tracks.csv ./tracks.csv" + learn_with, {"expected each file once", "tracks.csv twice"});
  expect_rejected("learn -" + learn_with, {"expected files, found -", "sila serve --stdin"});
  for (const std::string group : {"scene", "prior"}) {
    expect_rejected(group + " foo", {"expected a verb of `sila " + group + "`: ", "make", "; found foo"});
    expect_rejected(group, {"make", "; found none"});
  }
  expect_rejected("learn tracks.csv --modle m.sila", {"not expected: --modle"});
  expect_rejected("--foo", {"not expected: --foo"});
  expect_rejected("lern", {"sila: expected a verb (`sila --help` lists them); found lern"});
  expect_rejected("fuse m.sila", {"--out"});
  EXPECT_EQ(content_of(folder_ / "m.sila"), before);
}

}  // namespace
}  // namespace sila::tests
