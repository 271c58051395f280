#include "sila/io/scene.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "sila/io/scene_tracks.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::ScratchFolder;
using Json = nlohmann::json;

Json small_scene() {
  return {{"name", "yard"},
          {"origin", {1.0, 2.0}},
          {"axis_1", {2.0, 0.0}},
          {"axis_2", {0.0, 3.0}},
          {"sidewalk_width_m", 2.5}};
}

TEST(Scene, ReadsTheFourFieldsThatAUserMustGive) {
  const ScratchFolder folder;
  const Scene scene = read_scene(folder.write("s.json", small_scene().dump()));
  EXPECT_EQ(scene.name, "yard");
  ASSERT_EQ(scene.corners.size(), 1U);
  const CurbFrame& frame = scene.corners[0].frame;
  EXPECT_EQ(frame.origin_m, Vector2(1, 2));
  EXPECT_EQ(frame.axis_1, Vector2(1, 0));
  EXPECT_EQ(frame.axis_2, Vector2(0, 1));
  EXPECT_EQ(frame.unit_m, Vector2(1.0, 1.0));
  EXPECT_EQ(rescaled(frame, CurbScaling::mean_width).unit_m, Vector2(2.5, 2.5));
  EXPECT_TRUE(scene.files.empty());
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(Scene, ReadsAllCornersWithTheirWidths) {
  const ScratchFolder folder;
  Json json = small_scene();
  json["corners"] = Json::array();
  json["corners"].push_back(
      {{"name", "A"}, {"origin", {9, 9}}, {"axis_1", {1, 0}}, {"axis_2", {0, 1}}, {"sidewalk_width_m", 3}});
  Json primary = small_scene();
  primary["name"] = "B";
  primary["primary"] = true;
  primary["sidewalk_width_1_m"] = 2.0;
  primary["sidewalk_width_2_m"] = 3.0;
  json["corners"].push_back(primary);
  const Scene scene = read_scene(folder.write("s.json", json.dump()));
  ASSERT_EQ(scene.corners.size(), 2U);
  EXPECT_EQ(scene.primary, 1U);
  EXPECT_EQ(scene.corners[1].name, "B");
  EXPECT_EQ(scene.corners[0].widths.width_1_m, 3.0);
  EXPECT_EQ(scene.corners[1].widths.width_1_m, 2.0);
  EXPECT_EQ(scene.corners[1].widths.width_2_m, 3.0);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(Scene, UsesTheFirstLevelAndWarnsIfThePrimaryCornerDiffers) {
  const ScratchFolder folder;
  Json json = small_scene();
  Json other = small_scene();
  other["name"] = "B";
  other["primary"] = true;
  other["origin"] = {5.0, 5.0};
  json["corners"] = Json::array({other});
  const Scene scene = read_scene(folder.write("s.json", json.dump()));
  EXPECT_EQ(scene.corners[scene.primary].frame.origin_m, Vector2(1, 2));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(says(scene.warnings[0], "differ"));
}

TEST(Scene, WarnsOfMirroredAxes) {
  const ScratchFolder folder;
  Json json = small_scene();
  json["y_axis"] = "down";
  ASSERT_EQ(read_scene(folder.write("s.json", json.dump())).warnings.size(), 1U);
  json["axis_2"] = {0.0, -1.0};
  EXPECT_TRUE(read_scene(folder.write("s.json", json.dump())).warnings.empty());
  json["y_axis"] = "up";
  const Scene scene = read_scene(folder.write("s.json", json.dump()));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(says(scene.warnings[0], "mirrored"));
}

TEST(Scene, HasTheYAxisOfTheGroundOfACamera) {
  const auto y_axis = [](double scale) {
    return y_axis_of(camera_of(Eigen::DiagonalMatrix<double, 3>(0.02, scale, 1.0)));
  };
  EXPECT_EQ(y_axis(-0.02), YAxis::up);
  EXPECT_EQ(y_axis(0.02), YAxis::down);
}

struct BadField {
  const char* change;  ///< JSON merge patch
  const char* field;
  const char* found;
};

TEST(BadScene, IsRejectedNamingFileFieldExpectedAndFound) {
  const ScratchFolder folder;
  const std::vector<BadField> cases = {
      {R"({"origin": null})", "origin", "null"},
      {R"({"axis_1": null})", "axis_1", "null"},
      {R"({"axis_1": [1, 2, 3]})", "axis_1", "[1,2,3]"},
      {R"({"axis_2": "north"})", "axis_2", "north"},
      {R"({"axis_2": [0, 0]})", "axis_2", "no direction"},
      {R"({"axis_2": [1, 0.1]})", "axis_1, axis_2", "the angle between axis_1 and axis_2 is 5.71"},
      {R"({"sidewalk_width_m": 0})", "sidewalk_width_m", "0"},
      {R"({"sidewalk_width_m": -2})", "sidewalk_width_m", "-2"},
      {R"({"sidewalk_width_m": "wide"})", "sidewalk_width_m", "wide"},
      {R"({"sidewalk_width_1_m": 0})", "sidewalk_width_1_m", "0"},
      {R"({"y_axis": "left"})", "y_axis", "left"},
      {R"({"corners": 3})", "corners", "3"},
      {R"({"corners": [{"name": "A"}]})", "corners[0].", "no such field"},
      {R"({"files": [{"format": "csv"}]})", "files[0].path", "no such field"},
      {R"({"files": [{"path": "a", "frames_per_second": 0}]})", "files[0].frames_per_second", "0"},
      {R"({"files": [{"path": "a", "metres_per_unit": -1}]})", "files[0].metres_per_unit", "-1"},
      {R"({"files": [{"path": "a", "to_scene": {"a": 0, "b": 0}}]})", "files[0].to_scene.a", "0"},
  };
  for (const BadField& bad : cases) {
    SCOPED_TRACE(bad.change);
    Json json = small_scene();
    json.merge_patch(Json::parse(bad.change));
    const auto path = folder.write("s.json", json.dump());
    const auto error = tests::format_error_of([&] { read_scene(path); });
    EXPECT_EQ(error.path, path.string());
    EXPECT_TRUE(says(error.expected, bad.field));
    const bool gone = std::string(bad.found) == "null";  // a merge patch with null removes the field
    EXPECT_TRUE(says(error.found, gone ? "no such field" : bad.found));
    EXPECT_FALSE(says(error.found, R"("")"));  // a text is shown in one pair of quotes
  }
}

TEST(BadScene, IsRejectedWithTheLineIfItIsNotJson) {
  const ScratchFolder folder;
  const auto path = folder.write("s.json", "{\"origin\": [1, 2],\n\"axis_1\": oops}\n");
  EXPECT_EQ(tests::format_error_of([&] { read_scene(path); }).line, 2U);
  EXPECT_THROW(read_scene(folder.write("t.json", "[1, 2]")), FormatError);
  EXPECT_THROW(read_scene(folder.write("u.json", "")), FormatError);
  EXPECT_THROW(read_scene(folder.path() / "none.json"), FormatError);
}

TEST(Similarity, TurnsScalesAndShifts) {
  const SimilarityTransform quarter_turn{0.0, 2.0, 10.0, 20.0};
  EXPECT_EQ(apply(quarter_turn, Vector2(1, 0)), Vector2(10, 22));
  EXPECT_EQ(apply(quarter_turn, Vector2(0, 1)), Vector2(8, 20));
}

class SceneFiles : public ::testing::Test {
 protected:
  ScratchFolder folder;
  Json json = small_scene();
  std::string walk = "track_id,frame,x,y\n1,0,0,0\n1,10,1,0\n1,20,2,0\n";
  Scene read() const { return read_scene(folder.write("scenes/s.json", json.dump()), folder.path() / "data"); }
};

TEST_F(SceneFiles, AreFoundBesideTheSceneInItsParentAndInTheDataFolder) {
  folder.write("scenes/a.csv", walk);
  folder.write("tracks/b.csv", walk);
  folder.write("data/c.csv", walk);
  json["files"] = {{{"path", "a.csv"}}, {{"path", "tracks/b.csv"}}, {{"path", "c.csv"}}, {{"path", "d.csv"}}};
  const Scene scene = read();
  ASSERT_EQ(scene.files.size(), 4U);
  EXPECT_EQ(scene.files[0].resolved, folder.path() / "scenes/a.csv");
  EXPECT_EQ(scene.files[1].resolved, folder.path() / "tracks/b.csv");
  EXPECT_EQ(scene.files[2].resolved, folder.path() / "data/c.csv");
  EXPECT_TRUE(scene.files[3].resolved.empty());
  const auto error = tests::format_error_of([&] { read_tracks({}, scene, {}, {}); });
  EXPECT_TRUE(says(error.expected, "files[3].path"));
}

TEST_F(SceneFiles, ThatAreNowhereAreRejectedNamingTheEntryAndTheFolders) {
  json["files"] = {{{"path", "gone.csv"}}};
  const auto error = tests::format_error_of([&] { read_tracks({}, read(), {}, {}); });
  EXPECT_TRUE(says(error.expected, "files[0].path"));
  EXPECT_TRUE(says(error.expected, (folder.path() / "data").string()));
  EXPECT_TRUE(says(error.found, "gone.csv"));
}

TEST_F(SceneFiles, AreReadWithTheirOwnRatesScalesAndPlacement) {
  folder.write("data/a.csv", walk);
  folder.write("data/b.csv", walk);
  json["files"] = {{{"path", "a.csv"}, {"frames_per_second", 20}},
                   {{"path", "b.csv"},
                    {"frames_per_second", 40},
                    {"metres_per_pixel", 0.5},
                    {"to_scene", {{"a", 0}, {"b", 1}, {"tx", 100}, {"ty", 0}}}}};
  const CleanTracks tracks = read_tracks({}, read(), {}, {});
  ASSERT_EQ(tracks.trajectories.size(), 2U);
  EXPECT_EQ(tracks.trajectories[0].id, "a:1");
  EXPECT_EQ(tracks.trajectories[1].id, "b:1");
  EXPECT_EQ(tracks.trajectories[0].recording, 0u);
  EXPECT_EQ(tracks.trajectories[1].recording, 1u);
  EXPECT_DOUBLE_EQ(tracks.trajectories[0].times_s[2], 1.0);
  EXPECT_DOUBLE_EQ(tracks.trajectories[1].times_s[2], 0.5);
  EXPECT_EQ(tracks.trajectories[1].positions_m[2], Vector2(100, 1));
  const CleanTracks by_option = read_tracks({}, read(), {.frames_per_second = 10.0}, {});
  EXPECT_DOUBLE_EQ(by_option.trajectories[0].times_s[2], 2.0);
}

TEST_F(SceneFiles, NamedOnTheCommandLineUseTheirEntryAndTheOptionsWin) {
  const auto elsewhere = folder.write("elsewhere/a.csv", walk);
  json["files"] = {
      {{"path", "a.csv"}, {"frames_per_second", 20}, {"to_scene", {{"a", 1}, {"b", 0}, {"tx", 7}, {"ty", 0}}}}};
  const std::vector<std::filesystem::path> paths = {elsewhere};
  const CleanTracks by_entry = read_tracks(paths, read(), {}, {});
  EXPECT_DOUBLE_EQ(by_entry.trajectories.at(0).times_s[2], 1.0);
  EXPECT_EQ(by_entry.trajectories.at(0).positions_m[0], Vector2(7, 0));
  EXPECT_EQ(by_entry.trajectories.at(0).id, "1");
  const CleanTracks by_option = read_tracks(paths, read(), {.frames_per_second = 40.0}, {});
  EXPECT_DOUBLE_EQ(by_option.trajectories.at(0).times_s[2], 0.5);
}

TEST_F(SceneFiles, OfEqualNamesAreToldApartByTheirFolders) {
  json["files"] = {{{"path", "v1/a.csv"}, {"frames_per_second", 20}},
                   {{"path", "v2/a.csv"}, {"frames_per_second", 40}}};
  const Scene scene = read();
  ASSERT_NE(matching_entry(scene, "/some/where/v2/a.csv"), nullptr);
  EXPECT_EQ(matching_entry(scene, "/some/where/v2/a.csv")->path, "v2/a.csv");
  EXPECT_EQ(matching_entry(scene, "a.csv"), nullptr);
  EXPECT_EQ(matching_entry(scene, "b.csv"), nullptr);
}

TEST_F(SceneFiles, WithoutOneUsableTrackAreRejectedWithTheCounts) {
  folder.write("data/a.csv", "track_id,t,x,y,label\n1,0,0,0,car\n1,0.5,1,0,car\n");
  json["files"] = {{{"path", "a.csv"}}};
  const auto error = tests::format_error_of([&] { read_tracks({}, read(), {}, {}); });
  EXPECT_TRUE(says(error.expected, "at least one track"));
  EXPECT_TRUE(says(error.found, "dropped rows that are not pedestrians: 2"));
  EXPECT_TRUE(says(error.found, "class car; --person (person_classes) names the classes that count)"));
  json.erase("files");
  EXPECT_TRUE(says(tests::format_error_of([&] { read_tracks({}, read(), {}, {}); }).expected, "files"));
  EXPECT_EQ(tests::format_error_of([] { read_tracks({}, {}, {}, {}); }).path, "scene") << "not an empty name";
}

TEST(NearestCorner, GoesByTheFirstPosition) {
  Scene scene;
  for (const double x : {0.0, 10.0}) {
    scene.corners.push_back({"c", make_curb_frame(Vector2(x, 0), Vector2(1, 0), Vector2(0, 1), 1.0), {}});
  }
  Trajectory track{"1", {0, 1, 2}, {Vector2(4, 1), Vector2(4.5, 1), Vector2(400, 1)}};
  EXPECT_EQ(nearest_corner(scene, track), 0U);
  track.positions_m = {Vector2(8, 1), Vector2(4, 1), Vector2(4, 1)};
  EXPECT_EQ(nearest_corner(scene, track), 1U);
  EXPECT_THROW(nearest_corner(Scene{}, track), std::invalid_argument);
}

TEST(Scene, ThatBreaksItsInvariantIsRejected) {
  const Trajectory track{"a", {0.0}, {{0.0, 0.0}}};
  const auto why = [&](const Scene& scene) {
    return message_of([&] { frame_for(scene, track, CornerChoice::primary, CurbScaling::metres); });
  };
  Scene scene;
  EXPECT_TRUE(says(why(scene), "scene: corners = []"));
  scene.corners.push_back({"a", CurbFrame{}, {}});
  EXPECT_EQ(why(scene), "");
  scene.primary = 3;
  EXPECT_TRUE(says(why(scene), "scene: primary = 3, must be below 1"));
  EXPECT_THROW(to_text(scene), std::invalid_argument);
  scene.primary = 0;
  scene.corners.front().frame.axis_1 = Vector2::Zero();
  EXPECT_TRUE(says(why(scene), "axis_1"));
  EXPECT_THROW(scene_for(scene, {}, {}, CornerChoice::primary), std::invalid_argument);
  scene.corners.front().frame.axis_1 = Vector2::UnitX();
  scene.corners.front().widths.width_2_m = 0.0;
  EXPECT_TRUE(says(why(scene), "sidewalk_width_2_m = 0, they must be positive"));
}

TEST(WriteScene, WritesWhatReadSceneReads) {
  const ScratchFolder folder;
  Scene scene;
  scene.name = "made";
  scene.y_axis = YAxis::down;
  const SidewalkWidths widths{2.5, 2.0, 3.0};
  scene.corners.push_back(
      {"A", make_curb_frame(Vector2(1, 2), Vector2(1, 0), Vector2(-0.5, -0.8), widths.mean_m), widths});
  scene.corners.push_back({"B", make_curb_frame(Vector2(5, 2), Vector2(1, 0), Vector2(0, -1), 1.0), {}});
  scene.primary = 1;
  scene.files.push_back({"tracks.csv",
                         {},
                         {.format = TrackFormat::csv, .frames_per_second = 30.0, .metres_per_unit = 0.04},
                         {0.5, 0.25, 1, 2}});
  const auto path = folder.path() / "made.scene.json";
  write_scene(path, scene);
  const Scene again = read_scene(path);
  EXPECT_EQ(again.name, "made");
  EXPECT_EQ(again.y_axis, YAxis::down);
  EXPECT_EQ(again.primary, 1U);
  ASSERT_EQ(again.corners.size(), 2U);
  EXPECT_EQ(again.corners[0].name, "A");
  EXPECT_LT((again.corners[0].frame.axis_2 - scene.corners[0].frame.axis_2).norm(), 1e-15);
  EXPECT_EQ(again.corners[0].widths.width_2_m, 3.0);
  EXPECT_TRUE(again.warnings.empty());
  ASSERT_EQ(again.files.size(), 1U);
  EXPECT_EQ(again.files[0].to_scene, scene.files[0].to_scene);
  EXPECT_EQ(again.files[0].options.format, TrackFormat::csv);
  EXPECT_EQ(again.files[0].options.frames_per_second, 30.0);
  EXPECT_EQ(again.files[0].options.metres_per_unit, 0.04);
  EXPECT_THROW(write_scene(folder.path() / "no" / "s.json", scene), FormatError);
}

TEST(TrackReportJson, HasTheCountsUnderTheirNames) {
  TrackReport report;
  report.rows_read = 5;
  report.rows_kept = 3;
  report.dropped = {{DropReason::lost, 2, "a.txt:7"}};
  report.warnings = {"careful"};
  const Json json = to_json(report);
  EXPECT_EQ(json["rows_read"], 5);
  EXPECT_EQ(json["dropped"]["lost"]["rows"], 2);
  EXPECT_EQ(json["dropped"]["lost"]["first"], "a.txt:7");
  EXPECT_EQ(json["warnings"][0], "careful");
}

}  // namespace
}  // namespace sila
