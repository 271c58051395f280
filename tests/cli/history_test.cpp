// What became of a model and what may be given away: log, rollback, diff, verify, learn --share.
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "program.hpp"

namespace sila::tests {
namespace {

TEST_F(Program, ListsEpisodesAndGoesBackToAnyOfThem) {
  simulate();
  const std::string first_half = "learn tracks.csv --scene tracks.scene.json --batch 20 --model ";
  ASSERT_EQ(run(first_half + "m.sila").code, 0);
  fs::copy(folder_ / "m.sila", folder_ / "three.sila");
  ASSERT_EQ(run("simulate --tracks 40 --seed 2 --set simulate.occlusions_per_min=0 --out more.csv").code, 0);
  ASSERT_EQ(run("learn more.csv --scene more.scene.json --model m.sila --batch 20").code, 0);
  const auto log = json_of("log m.sila --json");
  ASSERT_EQ(log.at("episodes").size(), 5u);
  EXPECT_EQ(log.at("oldest_rollback"), 1);
  for (const auto& episode : log["episodes"]) {
    EXPECT_EQ(episode.at("tracks"), 20);
    EXPECT_GT(episode.at("committed_s").get<long>(), 1700000000);
    EXPECT_TRUE(episode.contains("added") && episode.contains("fused") && episode.contains("split"));
  }
  EXPECT_EQ(log["episodes"][4]["size_before"], log["episodes"][3]["size_after"]);
  const std::string table = run("log m.sila").out;
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 7);
  const Outcome back = run("rollback m.sila --to 3");
  ASSERT_EQ(back.code, 0) << back.err;
  EXPECT_TRUE(says(back.out, "as it was after episode 3"));
  const auto without_bytes = [&](const std::string& model) {
    auto json = json_of("inspect --json " + model);
    json.erase("bytes");
    return json;
  };
  EXPECT_EQ(without_bytes("m.sila"), without_bytes("three.sila"));
  const auto difference = json_of("diff m.sila three.sila --json");
  EXPECT_TRUE(difference.at("primitives").at("only_a").empty() && difference["primitives"]["changed"].empty());
  for (const auto& horizon : difference.at("predictions")) EXPECT_EQ(horizon.at("max_m"), 0.0);
  const std::string predict = "predict tracks.csv --scene tracks.scene.json --model ";
  EXPECT_EQ(run(predict + "m.sila").out, run(predict + "three.sila").out);
  EXPECT_TRUE(says(run("rollback m.sila --keep 2").out, "m.sila: unchanged after episode 3"));
  ASSERT_EQ(run("rollback m.sila --to 2 --keep 1").code, 0);
  expect_rejected("rollback m.sila --to 5", {"m.sila", "from episode 1 to 2"});
  expect_rejected("rollback m.sila", {"--to or --keep"});
  expect_rejected("rollback none.sila --to 1", {"no such file"});
}

TEST_F(Program, ServiceGoesOnFromWhatARollbackLeft) {
  simulate();
  ASSERT_EQ(run("simulate --tracks 60 --seed 2 --set simulate.occlusions_per_min=0 --out more.csv").code, 0);
  for (const char* name : {"tracks", "more"})
    ASSERT_EQ(run("replay " + std::string(name) + ".csv --rate 1e6 > " + name + ".ndjson").code, 0);
  // A service that receives the first people, then nothing while a pedestrian rolls its file back, then the others.
  const auto until_reported = [](const std::string& words) {
    return "for i in $(seq 600); do if grep -q '" + words + "' reported; then break; fi; sleep 0.1; done; ";
  };
  folder_.write("live.sh", "touch reported; { cat tracks.ndjson; " + until_reported("episode 2 is stored") +
                               "'" SILA_PROGRAM "' rollback m.sila --to 1 >&2; " +
                               until_reported("continuing with its 1 episode") +
                               "cat more.ndjson; } | '" SILA_PROGRAM
                               "' serve --stdin --wait --http off --batch 20 --scene tracks.scene.json --model m.sila "
                               ">predictions 2>reported\n");
  ASSERT_EQ(std::system(("cd '" + folder_.path().string() + "' && sh live.sh").c_str()), 0);
  const std::string reported = content_of(folder_ / "reported");
  EXPECT_TRUE(says(reported, "changed by another process; continuing with its 1 episode"));
  const auto log = json_of("log m.sila --json");
  EXPECT_GE(log.at("episodes").size(), 4u) << reported;  // the first, and those of the others
  for (std::size_t i = 0; i < log["episodes"].size(); ++i) EXPECT_EQ(log["episodes"][i].at("number"), i + 1);
  EXPECT_EQ(run("verify m.sila").code, 0);
}

TEST_F(Program, TellsWhatDiffersBetweenTwoModels) {
  learn();
  ASSERT_EQ(run("simulate --tracks 40 --seed 2 --set simulate.occlusions_per_min=0 --out more.csv").code, 0);
  fs::copy(folder_ / "m.sila", folder_ / "n.sila");
  ASSERT_EQ(run("learn more.csv --scene more.scene.json --model n.sila --batch 20").code, 0);
  const Outcome reported = run("diff m.sila n.sila");
  ASSERT_EQ(reported.code, 0) << reported.err;
  for (const char* part : {"primitives ", "transitions ", "only in B", "at 5.0 s: "})
    EXPECT_TRUE(says(reported.out, part));
  const auto on_tracks = json_of("diff m.sila n.sila more.csv --scene more.scene.json --json");
  EXPECT_GT(on_tracks.at("windows").get<int>(), 20);
  EXPECT_GT(on_tracks.at("predictions").back().at("mean_m").get<double>(), 0.001);
  EXPECT_GT(on_tracks.at("transitions").at("only_b").size() + on_tracks["transitions"]["changed"].size(), 0u);
  // Without a scene the tracks lie in the frame of the first model.
  EXPECT_GT(json_of("diff m.sila n.sila more.csv --json").at("windows").get<int>(), 20);
  EXPECT_FALSE(says(reported.err, "no site in common"));
  ASSERT_EQ(run("learn more.csv --model without_scene.sila").code, 0);
  EXPECT_TRUE(says(run("diff m.sila without_scene.sila").err, "no site in common"));
}

TEST_F(Program, VerifiesAModelInOneLineAndSaysWhatHelps) {
  learn();
  const Outcome whole = run("verify m.sila");
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_EQ(std::count(whole.out.begin(), whole.out.end(), '\n'), 1);
  EXPECT_TRUE(says(whole.out, "intact"));
  EXPECT_EQ(json_of("verify m.sila --json").at("undone"), 2);
  std::string bytes = content_of(folder_ / "m.sila");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  folder_.write("m.sila", bytes);
  expect_rejected("verify m.sila", {"m.sila", "damaged"});
  folder_.write("m.sila", "no model");
  expect_rejected("verify m.sila", {"m.sila", "another kind"});
}

TEST_F(Program, SharesOnlyWhatEnoughTracksShowed) {
  simulate();
  const std::string learning = "learn tracks.csv --scene tracks.scene.json --model m.sila --batch 20 --share s.sila";
  const Outcome shared = run(learning + " --min-people 5");
  ASSERT_EQ(shared.code, 0) << shared.err;
  EXPECT_TRUE(says(shared.err, "each shown by 5 different tracks"));
  const auto home = json_of("inspect m.sila --json");
  const auto away = json_of("inspect s.sila --json");
  EXPECT_LT(away.at("size"), home.at("size"));
  EXPECT_GT(away.at("size"), 0);
  EXPECT_TRUE(away.at("records").empty());
  EXPECT_EQ(json_of("verify s.sila --json").at("undone"), 0);
  EXPECT_EQ(run("predict tracks.csv --scene tracks.scene.json --model s.sila --out p.ndjson").code, 0);
  const Outcome none =
      run("learn tracks.csv --scene tracks.scene.json --model n.sila --batch 20 --min-people 61 --share t.sila");
  EXPECT_EQ(none.code, 0);
  EXPECT_TRUE(says(none.err, "not written"));
  EXPECT_FALSE(fs::exists(folder_ / "t.sila"));
  expect_rejected(learning, {"--min-people and --share"});
  expect_rejected("learn tracks.csv --scene tracks.scene.json --model m.sila --min-people 5", {"--share"});
}

TEST_F(Program, BeginsANewPlaceWithAPrior) {
  learn();
  folder_.write("p.sila", "");  // as after a full disk
  const Outcome made = run("prior make m.sila --out p.sila");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(says(made.out, "begin each new place with a copy"));
  const auto prior = json_of("inspect p.sila --json");
  EXPECT_EQ(prior.at("size"), 0);
  EXPECT_GT(prior.at("prior_windows").get<double>(), 100.0);
  EXPECT_EQ(run("predict tracks.csv --scene tracks.scene.json --model p.sila --out p.ndjson").code, 0);
  fs::copy(folder_ / "p.sila", folder_ / "new.sila");
  const Outcome learnt = run("learn tracks.csv --scene tracks.scene.json --model new.sila --batch 20");
  ASSERT_EQ(learnt.code, 0) << learnt.err;
  EXPECT_FALSE(says(learnt.err, "prior make"));
  const auto model = json_of("inspect new.sila --json");
  EXPECT_EQ(model.at("prior_windows"), prior.at("prior_windows"));
  EXPECT_EQ(model.at("size"), json_of("inspect m.sila --json").at("size"));
  EXPECT_TRUE(says(run("prior make --out s.sila --set predict.horizon_s=3").out, "from simulated pedestrians"));
  EXPECT_EQ(run("predict tracks.csv --scene tracks.scene.json --model s.sila --out s.ndjson").code, 0);
  expect_rejected("prior make m.sila --out q.sila --set predict.horizon_s=3", {"for a prior without models"});
  expect_rejected("prior make tracks.csv --out q.sila", {"tracks.csv"});
  expect_rejected("prior make m.sila m.sila --out q.sila", {"would count twice"});
  const Outcome few =
      run("learn tracks.csv --scene tracks.scene.json --model short.sila --batch 30 --set predict.horizon_s=3");
  ASSERT_EQ(few.code, 0) << few.err;
  EXPECT_TRUE(says(few.err, "`sila prior make --out NEW.sila`"));
  expect_rejected("prior make m.sila short.sila --out q.sila", {"predict.horizon_s = 5", "predict.horizon_s = 3"});
}

}  // namespace
}  // namespace sila::tests
