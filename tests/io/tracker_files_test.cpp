// Boxes of image trackers, and the simulator SUMO.

#include <gtest/gtest.h>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "sila/core/clean.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/io/track_files.hpp"

namespace sila {
namespace {

using tests::contains;
using tests::expect_row;
using tests::format_error_of;
using tests::rows_of;
using tests::TempFolder;

ReadOptions at_rate(double frames_per_second) {
  ReadOptions options;
  options.frames_per_second = frames_per_second;
  return options;
}

TEST(MotChallenge, GivesTheFootOfEachBox) {
  const TempFolder folder;
  const auto file = read_detections(folder.write("mot.txt",
                                                 "1,3,100,50,40,120,0.91,-1,-1,-1\n26,3,110.5,50,40,120,0.9,-1,-1,-1\n"
                                                 "26,4,10,50,0,120,0.9,-1,-1,-1\n27,4,10,fifty,9,120,0.9,-1,-1,-1\n"),
                                    at_rate(25.0));
  EXPECT_EQ(file.format, TrackFormat::mot);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "3", 0.04, 120.0, 170.0);
  expect_row(file.detections.rows[1], "3", 1.04, 130.5, 170.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  ASSERT_EQ(file.detections.warnings.size(), 1U);
  EXPECT_TRUE(contains(file.detections.warnings[0], "pixels"));
}

TEST(MotChallenge, KeepsThePedestriansOfAGroundTruthThatCount) {
  const TempFolder folder;
  const auto path = folder.write("gt.txt",
                                 "1,1,0,0,10,20,1,1,0.8\n1,2,0,0,10,20,1,3,1\n1,3,0,0,10,20,0,1,1\n"
                                 "1,4,0,0,10,20\n");
  const auto file = read_detections(path, at_rate(30.0));
  ASSERT_EQ(file.detections.rows.size(), 2U);
  EXPECT_EQ(file.detections.rows[0].label, "person");
  EXPECT_EQ(file.detections.rows[1].label, "3");
  EXPECT_EQ(rows_of(file.detections, DropReason::lost), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  ReadOptions cars = at_rate(30.0);
  cars.person_classes = {"3"};
  EXPECT_EQ(read_detections(path, cars).detections.rows[1].label, "person");
  EXPECT_NE(read_detections(path, cars).detections.rows[0].label, "person");
}

TEST(MotChallenge, NeedsAFrameRateAndAKnownNumberOfColumns) {
  const TempFolder folder;
  const auto no_rate =
      format_error_of([&] { read_detections(folder.write("mot.txt", "1,3,100,50,40,120,0.91,-1,-1,-1\n")); });
  EXPECT_TRUE(contains(no_rate->what(), "frames_per_second"));
  const auto few = format_error_of([&] { read_detections(folder.write("few.txt", "1,3,100,50,40\n")); });
  EXPECT_TRUE(contains(few->what(), "few.txt:1"));
}

TEST(JsonArrays, AreReadAsTheRowsOfATable) {
  const TempFolder folder;
  const std::string sink = R"([
    {"x_min": 10.0, "y_min": 20.0, "x_max": 30.0, "y_max": 80.5, "class_id": 0, "confidence": 0.9, "tracker_id": 4,
     "class_name": "a \"tab\tand , ] }", "frame_index": 0, "zone": [1, 2]},
    {"frame_index": 25, "x_min": 12.0, "y_min": 20.0, "x_max": 32.0, "y_max": 80.5, "class_id": 2, "confidence": 0.8,
     "tracker_id": 4, "class_name": "#"},
    {"x_min": 1, "y_min": 2, "x_max": 3, "y_max": 4, "class_id": 0, "tracker_id": "", "frame_index": 25},
    {"x_min": NaN, "y_min": 2, "x_max": 3, "y_max": 4, "class_id": 0, "tracker_id": 5, "frame_index": 25},
    {"x_min": null, "y_min": 2, "x_max": 3, "y_max": 4, "class_id": 0, "tracker_id": 5, "frame_index": 25},
    {"x_min": 3, "y_min": 2, "x_max": 3, "y_max": 4, "class_id": 0, "tracker_id": 5, "frame_index": 25},
    7, []
])";
  const auto file = read_detections(folder.write("sink.json", sink), at_rate(25.0));
  EXPECT_EQ(file.format, TrackFormat::boxes);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "4", 0.0, 20.0, 80.5);
  expect_row(file.detections.rows[1], "4", 1.0, 22.0, 80.5);
  EXPECT_EQ(file.detections.rows[0].line, 2U);
  EXPECT_EQ(file.detections.rows[1].line, 4U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 3U);
  EXPECT_EQ(file.detections.rows_read, 8U);
}

TEST(JsonArrays, MayHaveTheColumnsOfAnyTable) {
  const TempFolder folder;
  const auto file = read_detections(folder.write(
      "t.json", R"([{"track_id":"a","t":0.5,"x":1,"y":-2e0,"label":"person"},{"y":1,"x":2,"t":1,"track_id":17}])"));
  EXPECT_EQ(file.format, TrackFormat::csv);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "a", 0.5, 1.0, -2.0);
  expect_row(file.detections.rows[1], "17", 1.0, 2.0, 1.0);
  EXPECT_EQ(file.detections.rows[0].label, "person");
}

TEST(JsonArrays, ThatAreDamagedOrNoTracksAreRefused) {
  const TempFolder folder;
  const std::string row = R"({"track_id":"a","t":0.5,"x":1,"y":2})";
  for (const std::string& text : {"[\n" + row, "[" + row + "] x", std::string("[]"), std::string("[[1],2]"),
                                  std::string(R"([{"a":1,"b":2}])"), std::string("[\"a")}) {
    const auto error = format_error_of([&] { read_detections(folder.write("bad.json", text)); });
    ASSERT_TRUE(error) << text;
    EXPECT_TRUE(contains(error->what(), "bad.json")) << error->what();
  }
  ReadOptions forced;
  forced.format = TrackFormat::ndjson;
  EXPECT_TRUE(format_error_of([&] { read_detections(folder.write("t.json", "[" + row + "]"), forced); }));
}

TEST(KittiTracking, GivesThePlaceOnTheGroundOrTheFootOfTheBox) {
  const TempFolder folder;
  const std::string placed =
      "0 2 Pedestrian 0 0 -1.5 100 50 140 170 1.7 0.6 0.9 7.5 1.6 9.5 -0.9\n"
      "0 -1 DontCare -1 -1 -10 219 188 245 218 -1000 -1000 -1000 -10 -1 -1 -1\n"
      "5 2 Pedestrian 0 0 -1.5 100 50 140 170 1.7 0.6 0.9 8 1.6 9.5 -0.9\n";
  const auto file = read_detections(folder.write("placed.txt", placed));
  EXPECT_EQ(file.format, TrackFormat::kitti);
  EXPECT_FALSE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[2], "2", 0.5, 8.0, 9.5);
  EXPECT_EQ(file.detections.rows[1].label, "DontCare");
  const auto boxes = read_detections(
      folder.write("boxes.txt", "0 2 Pedestrian -1 -1 -10 100 50 140 170 -1 -1 -1 -1000 -1000 -1000 -10 0.9\n"));
  EXPECT_TRUE(boxes.pixels);
  expect_row(boxes.detections.rows[0], "2", 0.0, 120.0, 170.0);
}

TEST(SumoFcd, GivesPersonsAndCountsTheRest) {
  const TempFolder folder;
  const auto file = read_detections(folder.write(
      "fcd.xml",
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fcd-export>\n  <timestep time=\"0.00\">\n"
      "    <person id=\"p&amp;1\" x=\"1.5\" y=\"2\" angle=\"90\" speed=\"1.3\"/>\n    <vehicle id=\"v\" x=\"9\" "
      "y=\"9\"/>\n"
      "  </timestep>\n  <timestep time=\"0.50\">\n    <person id=\"p&amp;1\" x=\"2.0\" y=\"2\"/>\n"
      "    <person id=\"q\" x=\"far\" y=\"2\"/>\n    <person x=\"1\" y=\"2\"/>\n  </timestep>\n</fcd-export>\n"));
  EXPECT_EQ(file.format, TrackFormat::sumo_fcd);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[0], "p&1", 0.0, 1.5, 2.0);
  EXPECT_EQ(file.detections.rows[0].line, 4U);
  EXPECT_EQ(file.detections.rows[1].label, "vehicle");
  expect_row(file.detections.rows[2], "p&1", 0.5, 2.0, 2.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  EXPECT_EQ(file.detections.rows_read, 5U);
}

TEST(SumoFcd, RejectsOtherAndDamagedXml) {
  const TempFolder folder;
  const auto cut = format_error_of([&] {
    read_detections(folder.write("cut.xml", "<fcd-export>\n<timestep time=\"0\"><person id=\"a\" x=\"1\" y=\"2\"/>\n"));
  });
  EXPECT_TRUE(contains(cut->what(), "cut.xml:3")) << cut->what();
  const auto returns = format_error_of([&] { read_detections(folder.write("returns.xml", "<fcd-export>\r\r\n<&\n")); });
  EXPECT_TRUE(contains(returns->what(), "returns.xml:2")) << returns->what();  // lines end with line feeds
  const auto other = format_error_of([&] { read_detections(folder.write("net.xml", "<net><edge id=\"1\"/></net>")); });
  EXPECT_TRUE(contains(other->what(), "fcd-export")) << other->what();
}

TEST(BoxTables, ReadTheColumnsOfSupervision) {
  const TempFolder folder;
  const auto file = read_detections(
      folder.write("sink.csv",
                   "x_min,y_min,x_max,y_max,class_id,confidence,tracker_id,frame_index\n100,50,140,170,0,0.9,4,0\n"
                   "102,50,142,170,0,0.9,4,10\n10,20,30,80,2,0.9,5,10\n30,20,10,80,0,0.9,6,10\n"),
      at_rate(10.0));
  EXPECT_EQ(file.format, TrackFormat::boxes);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[1], "4", 1.0, 122.0, 170.0);
  EXPECT_EQ(file.detections.rows[1].label, "person");
  EXPECT_EQ(file.detections.rows[2].label, "2");
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
}

const char* const kCamera =
    R"({"image_points": [[0, 1000], [1000, 1000], [400, 500], [600, 500]], "ground_points": [[0, 0], [10, 0], [0, 20], [10, 20]]})";

TEST(CameraFile, MakesMetresOfBoxesAndDropsThoseAboveTheHorizon) {
  const TempFolder folder;
  ReadOptions options = at_rate(10.0);
  options.camera = read_camera(folder.write("camera.json", kCamera)).camera;
  const auto file = read_detections(
      folder.write("mot.txt",
                   "0,1,-5,900,10,100,1,-1,-1,-1\n1,1,395,400,10,100,1,-1,-1,-1\n2,1,395,0,10,100,1,-1,-1,-1\n"),
      options);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  EXPECT_NEAR((file.detections.rows[0].position_m - Vector2(0, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((file.detections.rows[1].position_m - Vector2(0, 20)).norm(), 0.0, 1e-9);
  EXPECT_EQ(rows_of(file.detections, DropReason::above_horizon), 1U);
  EXPECT_TRUE(file.detections.warnings.empty());
  options.metres_per_unit = 0.1;
  EXPECT_THROW(read_detections(folder / "mot.txt", options), std::invalid_argument);
}

TEST(CameraFile, IsTakenFromASceneAndRoundTrips) {
  const TempFolder folder;
  const auto path = folder.write("s.json", R"({"origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1],
    "sidewalk_width_m": 3, "camera": )" + std::string(kCamera) +
                                               "}");
  const Scene scene = read_scene(path, CurbScaling::metres);
  ASSERT_TRUE(scene.camera);
  const auto mot = folder.write("mot.txt", "0,1,-5,900,10,100,1,-1,-1,-1\n1,1,-4,900,10,100,1,-1,-1,-1\n");
  const CleanTracks tracks = read_tracks(std::vector{mot}, scene, at_rate(10.0), CleanConfig{});
  EXPECT_NEAR(tracks.trajectories.at(0).positions_m.at(1).x(), 0.01, 1e-9);
  write_scene(folder / "again.json", scene);
  const Scene again = read_scene(folder / "again.json", CurbScaling::metres);
  EXPECT_NEAR((again.camera->ground_from_image - scene.camera->ground_from_image).norm(), 0.0, 1e-12);
}

TEST(CameraFile, WarnsOfLargeResidualsAndNamesTheFileOfWrongOnes) {
  const TempFolder folder;
  const std::string six =
      R"({"image_points": [[0,1000],[1000,1000],[400,500],[600,500],[500,700],[500,1000]],
          "ground_points": [[0,0],[10,0],[0,20],[10,20],[5,12],[5,4]]})";
  const CameraFile read = read_camera(folder.write("six.json", six));
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_TRUE(contains(read.warnings[0], "pair ")) << read.warnings[0];
  for (const char* text :
       {R"({"image_points": [[0, 0]], "ground_points": [[0, 0]]})", R"({"image_points": [[0, 0]]})",
        R"({"image_points": [[0, "a"]], "ground_points": []})", R"({"homography": [[1, 0, 0], [0, 1, 0]]})",
        R"({"homography": [[1, 0, 0], [0, 1, 0], [0, 0, 0]]})", R"({"homography": 3})", "[1, 2]"}) {
    const auto error = format_error_of([&] { read_camera(folder.write("bad.json", text)); });
    ASSERT_TRUE(error) << text;
    EXPECT_TRUE(contains(error->what(), "bad.json")) << error->what();
  }
}

}  // namespace
}  // namespace sila
