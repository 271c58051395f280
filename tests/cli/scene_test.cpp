#include <nlohmann/json.hpp>
#include <string>

#include "program.hpp"

namespace sila::tests {
namespace {

TEST_F(Program, ProposesASceneFromTracks) {
  simulate();
  const Outcome made = run("scene make tracks.csv");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_TRUE(says(made.err, "corner at x = 4"));
  const auto scene = nlohmann::json::parse(made.out);
  EXPECT_NEAR(scene["origin"][0].get<double>(), 4.0, 1.5);
  EXPECT_GT(scene["corners"][0]["origin_uncertainty_m"].get<double>(), 0.0);
  folder_.write("made.json", made.out);
  ASSERT_EQ(run("simulate --tracks 60 --seed 1 --out more.csv").code,
            0);  // some parts have another of the four corners
  const auto other = json_of("scene make more.csv");
  ASSERT_EQ(run("simulate --tracks 20 --seed 2 --out tilted.csv").code, 0);
  EXPECT_TRUE(says(run("scene make tilted.csv").err, "axis 1: heading 0 degrees"));
  EXPECT_LT(other["corners"][0]["axis_uncertainty_deg"].get<double>(), 5.0);
  EXPECT_EQ(run("learn tracks.csv --scene made.json --model m.sila").code, 0);
  const Outcome quiet = run("scene make tracks.csv --json");
  EXPECT_EQ(quiet.out, made.out);
  EXPECT_FALSE(says(quiet.err, "corner at"));
  folder_.write("few.csv", "track_id,t,x,y\na,0,1,2\na,1,9,2\n");
  expect_rejected("scene make few.csv", {"tracks that move 3 m or more, found 1", "at least 10"});
  expect_rejected("scene make", {"tracks"});
  auto unnamed = nlohmann::json::parse(content_of(folder_ / "tracks.scene.json"));
  unnamed["name"] = "";
  folder_.write("unnamed.json", unnamed.dump());
  const Outcome named = run("scene make --scene unnamed.json");
  ASSERT_EQ(named.code, 0) << named.err;
  EXPECT_EQ(nlohmann::json::parse(named.out)["name"], "unnamed");
  expect_rejected("scene make tracks.csv --map map.osm", {"--map", "Python package", "sila[map]"});
}

/// Six people in pixels, as MOTChallenge has them.
std::string mot_rows() {
  std::string rows;
  for (int id = 0; id < 6; ++id) {
    for (int frame = 0; frame < 80; ++frame) {
      rows += std::to_string(frame + 100 * id) + "," + std::to_string(id) + "," + std::to_string(100 + 4 * frame) +
              ",500,40,120,1,-1,-1,-1\n";
    }
  }
  return rows;
}

TEST_F(Program, MakesAPageThatEditsAScene) {
  simulate();
  ASSERT_EQ(run("scene edit tracks.csv --out editor.html").code, 0);
  const std::string page = content_of(folder_ / "editor.html");
  EXPECT_TRUE(page.starts_with("<!doctype html>"));
  EXPECT_LT(page.size(), 2'000'000u);
  const auto proposed = json_of("scene edit tracks.csv --json");
  const auto made = json_of("scene make tracks.csv");
  EXPECT_EQ(proposed["file"]["origin"], made["origin"]);
  EXPECT_EQ(proposed["file_name"], "tracks.scene.json");
  const auto given = json_of("scene edit tracks.csv --scene tracks.scene.json --json");
  EXPECT_EQ(given["file"]["corners"].size(), 4u);
  EXPECT_EQ(given["proposal"], "The corner is that of tracks.scene.json.");
  folder_.write("few.csv", "track_id,t,x,y\na,0,1,2\na,1,9,2\n");
  const auto few = json_of("scene edit few.csv --json");
  EXPECT_TRUE(says(few["proposal"].get<std::string>(), "at least 10"));
  EXPECT_EQ(few["file"]["sidewalk_width_m"], 3.0);
  expect_rejected("scene edit", {"tracks"});
  expect_rejected("scene edit none.csv", {"none.csv"});
}

TEST_F(Program, MakesAPageThatEditsASceneOnAPicture) {
  simulate();
  folder_.write("mot.txt", mot_rows());
  folder_.write("p.png", "\x89PNG\r\n\x1a\n");
  const auto data_of = [&](const std::string& arguments) {
    const Outcome outcome = run("scene edit --picture p.png --json " + arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto pixels = data_of("mot.txt --fps 10");
  EXPECT_EQ(pixels["tracks_in"], "picture");
  EXPECT_EQ(pixels["tracks"].size(), 6u) << "nothing is cut because pixels are fast";
  EXPECT_NEAR(pixels["tracks"][0][0].get<double>(), 120.0, 1e-6);
  EXPECT_TRUE(pixels["file"]["corners"].empty());
  folder_.write("camera.json", R"({"image_points": [[0, 1000], [1000, 1000], [300, 500], [700, 500]],
    "ground_points": [[0, 0], [10, 0], [0, 20], [10, 20]]})");
  const auto seen = data_of("mot.txt --fps 10 --camera camera.json");
  EXPECT_NEAR(seen["tracks"][0][0].get<double>(), 120.0, 0.01);
  EXPECT_EQ(seen["file"]["camera"]["image_points"].size(), 4u);
  EXPECT_EQ(seen["file"]["corners"].size(), 1u);
  EXPECT_EQ(seen["file"]["y_axis"], "up");
  folder_.write("above.json", R"({"homography": [[0.02, 0, 0], [0, 0.02, 0], [0, 0, 1]]})");
  EXPECT_EQ(data_of("mot.txt --fps 10 --camera above.json")["file"]["y_axis"], "down");
  const auto metres = data_of("tracks.csv");
  EXPECT_EQ(metres["tracks_in"], "ground");
  EXPECT_EQ(metres["file"]["files"][0]["metres_per_unit"], 1.0) << "a camera that is saved is not that of the tracks";
  EXPECT_EQ(data_of("tracks.csv --pixels")["tracks_in"], "picture");
  expect_rejected("scene edit tracks.csv --pixels", {"--picture"});
  expect_rejected("scene edit tracks.csv --picture none.png", {"none.png", "PNG or JPEG"});
  expect_rejected("scene edit tracks.csv --picture tracks.csv", {"tracks.csv", "PNG or JPEG"});
}

TEST_F(Program, LearnsFromPixelsThroughACameraAndPredictsIntoThePicture) {
  folder_.write("mot.txt", mot_rows());
  folder_.write("camera.json", R"({"image_points": [[0, 1000], [1000, 1000], [300, 500], [700, 500]],
    "ground_points": [[0, 0], [10, 0], [0, 20], [10, 20]]})");
  for (const char* verb : {"learn mot.txt --fps 10 --model n.sila", "replay mot.txt --fps 10"})
    expect_rejected(verb, {"mot.txt: expected positions in metres, found pixels", "--camera", "--units pixels"}, 1);
  expect_rejected("scene edit mot.txt --fps 10", {"--picture"}, 2);
  EXPECT_EQ(run("learn mot.txt --fps 10 --model o.sila --metres-per-unit 0.02").code, 0);
  const std::string with = "mot.txt --fps 10 --camera camera.json --model m.sila";
  ASSERT_EQ(run("learn " + with).code, 0);
  const Outcome predicted = run("predict --image " + with);
  ASSERT_EQ(predicted.code, 0) << predicted.err;
  const auto mode = nlohmann::json::parse(predicted.out.substr(0, predicted.out.find('\n'))).at("modes").at(0);
  EXPECT_EQ(mode.at("u").size(), mode.at("x").size());
  EXPECT_NEAR(mode.at("v").at(0).get<double>(), 620.0, 5.0);
  EXPECT_EQ(mode.at("cov_uv").at(0).size(), 3U);
  folder_.write("p.png", "\x89PNG\r\n\x1a\n");
  const Outcome report = run("report m.sila mot.txt --fps 10 --camera camera.json --picture p.png --json");
  ASSERT_EQ(report.code, 0) << report.err;
  const auto drawn = nlohmann::json::parse(report.out);
  EXPECT_EQ(drawn["picture"], "data:image/png;base64,iVBORw0KGgo=");
  EXPECT_EQ(drawn["camera"].size(), 9u);
  expect_rejected("report m.sila --picture p.png", {"--picture", "tracks"});
  expect_rejected("serve --model new.sila --picture p.png", {"--picture", "--camera"});
  folder_.write("metres.csv", "track_id,t,x,y\n1,0,1,2\n1,0.5,1,2.5\n");
  expect_rejected("report m.sila metres.csv --picture p.png", {"--picture", "--camera"});
  expect_rejected("report m.sila mot.txt --fps 10 --camera camera.json --picture camera.json", {"PNG or JPEG"});
  expect_rejected("predict metres.csv --model m.sila --image", {"--image", "--camera"});
  expect_rejected("learn mot.txt --fps 10 --metres-per-unit 0.1 --camera camera.json --model n.sila", {"camera"});
}

TEST_F(Program, LearnsFromPixelsWithoutACamera) {
  std::string rows = "track_id,t,x,y\n", metres = rows;
  for (int id = 0; id < 12; ++id) {
    for (int i = 0; i < 80; ++i) {
      const double u = 300.0 + 5.0 * i + id, v = 400.0 + 20.0 * id + 2.0 * i;  // 54 pixels a second
      rows += std::to_string(id) + "," + std::to_string(id + 0.1 * i) + "," + std::to_string(u) + "," +
              std::to_string(v) + "\n";
      metres += std::to_string(id) + "," + std::to_string(id + 0.1 * i) + "," + std::to_string(0.1 * i) + ",1\n";
    }
  }
  folder_.write("pixels.csv", rows);
  folder_.write("metres.csv", metres);
  const Outcome learnt = run("learn pixels.csv --units pixels --model m.sila");
  ASSERT_EQ(learnt.code, 0) << learnt.err;
  EXPECT_TRUE(says(learnt.err, "1 pixel = 0.0241 m"));
  EXPECT_FALSE(says(learnt.err, "warning"));
  EXPECT_TRUE(says(run("inspect m.sila").out, "pixels of 0.0241"));
  const Outcome predicted = run("predict pixels.csv --model m.sila --every 100");
  ASSERT_EQ(predicted.code, 0) << predicted.err;
  EXPECT_TRUE(says(predicted.err, "u and v are pixels"));
  const auto mode = nlohmann::json::parse(predicted.out.substr(0, predicted.out.find('\n'))).at("modes").at(0);
  EXPECT_NEAR(mode.at("u").back().get<double>() - mode.at("u").at(0).get<double>(), 50.0 * 4.6, 20.0);
  EXPECT_NEAR(mode.at("v").at(0).get<double>(), -mode.at("y").at(0).get<double>() / 0.02414, 1.0);
  EXPECT_FALSE(says(run("learn pixels.csv --model m.sila").err, "warning"));
  const Outcome replayed = run("replay pixels.csv --rate 1000 --set metres_per_pixel=0.02");
  EXPECT_TRUE(says(replayed.out, "\"x\":305.0"));
  folder_.write("lines.ndjson", replayed.out);
  const Outcome served = run("serve --stdin --wait --http off --model m.sila < lines.ndjson");
  EXPECT_TRUE(says(served.out, "\"cov_uv\":")) << served.err;
  EXPECT_TRUE(says(run("predict metres.csv --model m.sila").err, "are the positions metres"));
  expect_rejected("predict pixels.csv --model m.sila --metres-per-unit 0.1", {"metres_per_pixel", "new model"});
  for (const char* other : {"--camera c.json", "--metres-per-unit 0.1", "--scene s.json"})
    expect_rejected(std::string("learn pixels.csv --units pixels --model n.sila ") + other, {"--units pixels"});
  expect_rejected("learn pixels.csv --units furlongs --model n.sila", {"--units"});
  expect_rejected("learn metres.csv --units metres --model m.sila", {"learnt in pixels; name another model"});
  expect_rejected("learn metres.csv --units pixels --model n.sila", {"1.3 m", "are the positions metres"});
  ASSERT_EQ(run("learn metres.csv --model metres.sila").code, 0);
  expect_rejected("learn pixels.csv --units pixels --model metres.sila", {"learnt in metres; name another model"});
  expect_rejected("learn metres.csv --set metres_per_pixel=0.02 --model metres.sila",
                  {"metres_per_pixel = 0.02, but the model was learnt in metres"});
  expect_rejected("fuse m.sila metres.sila --out f.sila", {"not of one scale"});
  folder_.write("few.csv", rows.substr(0, 1000));
  expect_rejected("learn few.csv --units pixels --model n.sila", {"0 of the first 1 tracks", "camera"});
  folder_.write("bad.csv", rows.substr(0, 1000) + "7,x,1,1\n");
  expect_rejected("learn bad.csv --units pixels --model n.sila", {"dropped rows", "of the first 1 tracks"});
}

}  // namespace
}  // namespace sila::tests
