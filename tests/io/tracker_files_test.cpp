// Boxes of image trackers, and the simulator SUMO.

#include <gtest/gtest.h>

#include <algorithm>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "sila/core/clean.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/io/track_files.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::at_rate;
using tests::expect_row;
using tests::format_error_of;
using tests::kCamera;
using tests::read_text;
using tests::rows_of;
using tests::ScratchFolder;
using tests::write_gz;

TEST(MotChallenge, GivesTheFootOfEachBox) {
  const auto file = read_text("mot.txt",
                              "1,3,100,50,40,120,0.91,-1,-1,-1\n26,3,110.5,50,40,120,0.9,-1,-1,-1\n"
                              "26,4,10,50,0,120,0.9,-1,-1,-1\n27,4,10,fifty,9,120,0.9,-1,-1,-1\n",
                              at_rate(25.0));
  EXPECT_EQ(file.format, TrackFormat::mot);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "3", 0.04, 120.0, 170.0);
  expect_row(file.detections.rows[1], "3", 1.04, 130.5, 170.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  ASSERT_EQ(file.detections.warnings.size(), 1U);
  EXPECT_TRUE(says(file.detections.warnings[0], "pixels"));
}

TEST(MotChallenge, KeepsThePedestriansOfAGroundTruthThatCount) {
  const std::string text = "1,1,0,0,10,20,1,1,0.8\n1,2,0,0,10,20,1,3,1\n1,3,0,0,10,20,0,1,1\n1,4,0,0,10,20\n";
  const auto file = read_text("gt.txt", text, at_rate(30.0));
  ASSERT_EQ(file.detections.rows.size(), 2U);
  EXPECT_EQ(file.detections.rows[0].label, "person");
  EXPECT_EQ(file.detections.rows[1].label, "3");
  EXPECT_EQ(rows_of(file.detections, DropReason::lost), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  const ReadOptions cars{.frames_per_second = 30.0, .person_classes = {"3"}};
  EXPECT_EQ(read_text("gt.txt", text, cars).detections.rows[1].label, "person");
  EXPECT_NE(read_text("gt.txt", text, cars).detections.rows[0].label, "person");
}

TEST(MotChallenge, NeedsAFrameRateAndAKnownNumberOfColumns) {
  const auto no_rate = format_error_of([&] { read_text("mot.txt", "1,3,100,50,40,120,0.91,-1,-1,-1\n"); });
  EXPECT_TRUE(says(no_rate.what(), "frames_per_second"));
  for (const std::string row : {"1,3,100,50,40", "1,3,100,50,40,120,0.9,1"}) {
    const auto other = format_error_of([&] { read_text("other.txt", row); });
    const auto columns = std::to_string(std::ranges::count(row, ',') + 1);
    EXPECT_TRUE(says(other.what(), "other.txt:1: expected a header line"));
    EXPECT_TRUE(says(other.what(), "10 columns as in MOTChallenge, found " + columns + " columns"));
  }
}

TEST(JsonArrays, AreReadAsTheRowsOfATable) {
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
  const auto file = read_text("sink.json", sink, at_rate(25.0));
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
  const auto file = read_text(
      "t.json", R"([{"track_id":"a","t":0.5,"x":1,"y":-2e0,"label":"person"},{"y":1,"x":2,"t":1,"track_id":17}])");
  EXPECT_EQ(file.format, TrackFormat::csv);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "a", 0.5, 1.0, -2.0);
  expect_row(file.detections.rows[1], "17", 1.0, 2.0, 1.0);
  EXPECT_EQ(file.detections.rows[0].label, "person");
}

TEST(JsonArrays, ThatAreDamagedOrNoTracksAreRefused) {
  const std::string row = R"({"track_id":"a","t":0.5,"x":1,"y":2})";
  for (const std::string& text : {"[\n" + row, "[" + row + "] x", std::string("[]"), std::string("[[1],2]"),
                                  std::string(R"([{"a":1,"b":2}])"), std::string("[\"a")}) {
    const auto error = format_error_of([&] { read_text("bad.json", text); });
    EXPECT_TRUE(says(error.what(), "bad.json")) << text;
  }
  EXPECT_THROW(read_text("t.json", "[" + row + "]", {.format = TrackFormat::ndjson}), FormatError);
}

TEST(TrackersInJson, ThatAreNestedTooDeeplyAreCountedAsNoJson) {
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const std::string event = R"({"after": {"id": "a", "frame_time": 1, "label": "person", "box": [1, 2, 3, 4]}})";
  const std::string events = R"({"after": {"id": )" + deep + R"(, "box": [1, 2, 3, 4]}})" + "\n" + event;
  const std::string row = R"({"t": 1, "id": "a", "x": 1, "y": 2})";
  const std::string array = "[" + row + R"(, {"t": 1, "id": "a", "x": )" + deep + R"(, "y": 2}])";
  for (const std::string& text : {events, array, row + "\n{\"t\": " + deep + "}"}) {
    const auto file = read_text("deep.json", text);
    EXPECT_EQ(file.detections.rows.size(), 1U);
    EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
  }
}

TEST(KittiTracking, GivesThePlaceOnTheGroundOrTheFootOfTheBox) {
  const std::string placed =
      "0 2 Pedestrian 0 0 -1.5 100 50 140 170 1.7 0.6 0.9 7.5 1.6 9.5 -0.9\n"
      "0 -1 DontCare -1 -1 -10 219 188 245 218 -1000 -1000 -1000 -10 -1 -1 -1\n"
      "5 2 Pedestrian 0 0 -1.5 100 50 140 170 1.7 0.6 0.9 8 1.6 9.5 -0.9\n";
  const auto file = read_text("placed.txt", placed);
  EXPECT_EQ(file.format, TrackFormat::kitti);
  EXPECT_FALSE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[2], "2", 0.5, 8.0, 9.5);
  EXPECT_EQ(file.detections.rows[1].label, "DontCare");
  const auto boxes =
      read_text("boxes.txt", "0 2 Pedestrian -1 -1 -10 100 50 140 170 -1 -1 -1 -1000 -1000 -1000 -10 0.9\n");
  EXPECT_TRUE(boxes.pixels);
  expect_row(boxes.detections.rows[0], "2", 0.0, 120.0, 170.0);
}

TEST(DeepStream, GivesTheBoxesOfAFolderWithAFileForEachFrame) {
  const ScratchFolder folder;
  const std::string unknown = " 0.0 0.0 0.0 0.0 0.0 0.0 0.0 0.9\n";
  folder.write("run/00_000_000000.txt", "person 7 0.0 0 0.0 100 50 140 170" + unknown);
  folder.write("run/00_000_000001.txt", "");
  folder.write("run/00_000_000002.txt",
               "car 9 0.0 0 0.0 0 0 10 10" + unknown + "person 7 0.0 0 0.0 110 50 150 170" + unknown + "person 7\n");
  const ReadOptions options = at_rate(25.0);
  const auto file = read_detections(folder.path() / "run", options);
  EXPECT_EQ(file.format, TrackFormat::kitti);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[0], "7", 0.0, 120.0, 170.0);
  EXPECT_EQ(file.detections.rows[1].label, "car");
  expect_row(file.detections.rows[2], "7", 0.08, 130.0, 170.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  EXPECT_TRUE(says(file.detections.dropped.front().first, "00_000_000002.txt:3"));
  write_gz(folder / "run/00_000_000003.txt.gz", "person 7 0.0 0 0.0 120 50 160 170" + unknown);
  EXPECT_EQ(read_detections(folder.path() / "run", options).detections.rows.size(), 4U);
  const auto no_rate = format_error_of([&] { read_detections(folder.path() / "run", {}); });
  EXPECT_TRUE(says(no_rate.what(), "--fps"));
  const auto alone = format_error_of([&] { read_detections(folder.path() / "run/00_000_000000.txt", options); });
  EXPECT_TRUE(says(alone.what(), "give the folder"));
  folder.write("run/00_000_000004.txt", "person 7 0.0 0 0.0 nan 50 160 170" + unknown);
  const Detections with_nan = read_detections(folder.path() / "run", options).detections;
  const std::vector<DroppedRows> dropped = clean(std::span(&with_nan, 1), {}).report.dropped;
  EXPECT_EQ(std::ranges::count(dropped, DropReason::not_finite, &DroppedRows::reason), 1);
  EXPECT_EQ(rows_of(with_nan, DropReason::bad_box), 0U);
  folder.write("run/00_001_000000.txt", "person 3 0.0 0 0.0 100 50 140 170" + unknown);
  const auto streams = format_error_of([&] { read_detections(folder.path() / "run", options); });
  EXPECT_TRUE(says(streams.what(), "00_000 and "));
  EXPECT_TRUE(says(streams.what(), "00_001"));
}

TEST(SumoFcd, GivesPersonsAndCountsTheRest) {
  const auto file = read_text(
      "fcd.xml",
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fcd-export>\n  <timestep time=\"0.00\">\n"
      "    <person id=\"p&amp;1\" x=\"1.5\" y=\"2\" angle=\"90\" speed=\"1.3\"/>\n    <vehicle id=\"v\" x=\"9\" "
      "y=\"9\"/>\n"
      "  </timestep>\n  <timestep time=\"0.50\">\n    <person id=\"p&amp;1\" x=\"2.0\" y=\"2\"/>\n"
      "    <person id=\"q\" x=\"far\" y=\"2\"/>\n    <person x=\"1\" y=\"2\"/>\n  </timestep>\n</fcd-export>\n");
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
  const auto cut = format_error_of(
      [&] { read_text("cut.xml", "<fcd-export>\n<timestep time=\"0\"><person id=\"a\" x=\"1\" y=\"2\"/>\n"); });
  EXPECT_TRUE(says(cut.what(), "cut.xml:3"));
  const auto returns = format_error_of([&] { read_text("returns.xml", "<fcd-export>\r\r\n<&\n"); });
  EXPECT_TRUE(says(returns.what(), "returns.xml:2"));  // lines end with line feeds
  const auto other = format_error_of([&] { read_text("net.xml", "<net><edge id=\"1\"/></net>"); });
  EXPECT_TRUE(says(other.what(), "fcd-export"));
}

TEST(BoxTables, ReadTheColumnsOfSupervision) {
  const auto file =
      read_text("sink.csv",
                "x_min,y_min,x_max,y_max,class_id,confidence,tracker_id,frame_index\n100,50,140,170,0,0.9,4,0\n"
                "102,50,142,170,0,0.9,4,10\n10,20,30,80,2,0.9,5,10\n30,20,10,80,0,0.9,6,10\n",
                at_rate(10.0));
  EXPECT_EQ(file.format, TrackFormat::boxes);
  ASSERT_EQ(file.detections.rows.size(), 3U);
  expect_row(file.detections.rows[1], "4", 1.0, 122.0, 170.0);
  EXPECT_EQ(file.detections.rows[1].label, "person");
  EXPECT_EQ(file.detections.rows[2].label, "2");
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
}

const std::string kFrigateEvent =
    R"({"type": "update", "before": {"id": "a.1", "box": [0, 0, 1, 1]}, "after": {"id": "a.1", "camera": "yard",
        "frame_time": 1700000000.25, "label": "person", "box": [100, 50, 140, 170]}})";

std::string in_one_line(std::string json) {
  std::erase(json, '\n');
  return json;
}

TEST(FrigateEvents, GiveTheFootOfTheBoxAfterEachChange) {
  const std::string good = in_one_line(kFrigateEvent);
  const auto file = read_text(
      "events.jsonl",
      good + "\n" +
          R"({"type": "end", "after": {"id": "b", "camera": "yard", "frame_time": 1700000001, "label": "car", "box": [1, 2, 3, 4]}})" +
          "\n{\"after\": {\"box\": 3}}\nnot JSON\n" +
          R"({"after": {"id": "a", "frame_time": "soon", "label": "person", "box": [1, 2, 3, 4]}})" + "\n" +
          R"({"after": {"id": "a", "frame_time": 3, "label": "person", "box": [3, 2, 3, 4]}})" + "\n" +
          R"({"after": {"frame_time": 3, "label": "person", "box": [1, 2, 3, 4]}})" + "\n");
  EXPECT_EQ(file.format, TrackFormat::frigate);
  EXPECT_TRUE(file.pixels);
  ASSERT_GE(file.detections.rows.size(), 1U);
  expect_row(file.detections.rows[0], "a.1", 1700000000.25, 120.0, 170.0);
  EXPECT_EQ(file.detections.rows[0].line, 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 1U);
  EXPECT_EQ(file.detections.rows_read,
            file.detections.rows.size() + 3 + rows_of(file.detections, DropReason::not_json));
}

TEST(FrigateEvents, OfTwoCamerasAreWarnedOf) {
  const std::string yard = in_one_line(kFrigateEvent);
  std::string side = yard;
  side.replace(side.find("yard"), 4, "side");
  const std::string text = yard + "\n" + side + "\n";
  const auto file = read_text("events.jsonl", text);
  ASSERT_EQ(file.detections.warnings.size(), 2U);  // the other one is of pixels
  EXPECT_TRUE(says(file.detections.warnings[1], "2 cameras"));
  const auto one = read_text("events.jsonl", text, {.frigate_camera = "side"});
  EXPECT_EQ(one.detections.warnings.size(), 1U);
  EXPECT_EQ(one.detections.rows.size(), 1U);
  EXPECT_EQ(rows_of(one.detections, DropReason::other_camera), 1U);
  EXPECT_TRUE(says(one.detections.dropped.at(0).first, "events.jsonl:1, found \"yard\""));
}

TEST(AxisFrames, GiveTheFootOfEachObservation) {
  const std::string frame = R"("observations": [{"track_id": "4", "class": {"type": "Human"},)"
                            R"("bounding_box": {"left": 0.25, "top": 0.5, "right": 0.75, "bottom": 0.875}},)"
                            R"({"track_id": "5", "bounding_box": {"left": 0, "top": 0, "right": 1, "bottom": 1}},)"
                            R"({"track_id": "6", "class": {"type": "Human"}}]}})";
  const auto file = read_text("scene.jsonl", R"({"frame": {"timestamp": "1970-01-01T00:00:10.500000Z", )" + frame +
                                                 R"(
{"frame": {"timestamp": "1970-01-01T00:00:10.6Z", "observations": []}}
{"frame": {"timestamp": "yesterday", )" + frame + "\n{\"data\": " +
                                                 R"({"frame": {"timestamp": "1970-01-01T01:00:11+01:00", )" + frame +
                                                 "}\n{\"frame\": 1}\n");
  EXPECT_EQ(file.format, TrackFormat::axis);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 4U);
  expect_row(file.detections.rows[0], "4", 10.5, 0.5, 0.875);
  EXPECT_EQ(file.detections.rows[1].label, "unknown");  // not classified yet
  expect_row(file.detections.rows[2], "4", 11.0, 0.5, 0.875);
  EXPECT_EQ(file.detections.rows[2].line, 4U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 5U);  // three without a time, two without a box
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
}

TEST(OtvisionTracks, GiveTheFootOfEachDetection) {
  const std::string text = R"({"metadata": {"detections": 4, "video": {"width": 800}},
 "data": {"detections": [
  {"class": "person", "x": 100.5, "y": 50, "w": 40, "h": 120, "frame": 1, "occurrence": 10.5, "track-id": 3},
  {"class": "car", "x": 1, "y": 1, "w": 1, "h": 1, "occurrence": "1970-01-01 00:00:11.250000", "track-id": 4},
  {"class": "person", "x": 1, "y": 1, "w": -1, "h": 1, "occurrence": 12, "track-id": 3},
  {"class": "person", "x": 1, "y": 1, "h": 1, "occurrence": 12, "track-id": 3}, 5]}})";
  const auto file = read_text("video.ottrk", text);
  EXPECT_EQ(file.format, TrackFormat::ottrk);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "3", 10.5, 120.5, 170.0);
  EXPECT_EQ(file.detections.rows[0].line, 3U);
  expect_row(file.detections.rows[1], "4", 11.25, 1.5, 2.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::bad_box), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
}

TEST(OtvisionTracks, ThatAreCutOrPackedAreRefused) {
  const auto cut =
      format_error_of([&] { read_text("cut.ottrk", "{\"metadata\": {}, \"data\": {\"detections\": [{\"x\": 1}"); });
  EXPECT_TRUE(says(cut.what(), "whole"));
  const auto none = format_error_of([&] { read_text("none.ottrk", R"({"metadata": {}})"); });
  EXPECT_TRUE(says(none.what(), "\"detections\""));
  const auto packed = format_error_of([&] { read_text("packed.ottrk", "BZh91AY&SY etc."); });
  EXPECT_TRUE(says(packed.what(), "bunzip2"));
  EXPECT_THROW(read_text("start.ottrk", "BZh"), FormatError);
}

TEST(OpenDataCamHistory, GivesTheFootOfEachObject) {
  const auto file = read_text("tracker.json", R"([
{"recordingId": "r", "timestamp": "1970-01-01T00:00:01.500Z", "objects": [
  {"id": 5, "x": 120, "y": 110, "w": 40, "h": 120, "bearing": 9, "name": "person"}, {"id": 6, "name": "car"}]},
{"timestamp": "1970-01-01T00:00:02.000Z", "objects": [{"id": 5, "x": 121, "y": 110, "w": 40, "h": 120, "name": "person"}]},
{"timestamp": "1970-01-01T00:00:02.500Z", "objects": []}, {"timestamp": "1970-01-01T00:00:03.000Z"}])");
  EXPECT_EQ(file.format, TrackFormat::opendatacam);
  EXPECT_TRUE(file.pixels);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "5", 1.5, 120.0, 170.0);
  expect_row(file.detections.rows[1], "5", 2.0, 121.0, 170.0);
  EXPECT_EQ(file.detections.rows[1].line, 4U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
}

TEST(TrackersInJson, AreTakenThroughACameraAndReadWholeByAStream) {
  const ScratchFolder folder;
  std::string text = "[";  // one line that is longer than a block
  for (int i = 0; i < 200; ++i)
    text += std::string(i > 0 ? "," : "") + R"({"timestamp": "2024-01-01T00:00:)" + std::to_string(10 + i / 10) + "." +
            std::to_string(i % 10) + R"(Z", "objects": [{"id": 5, "x": 500, "y": )" + std::to_string(600 + i) +
            R"(, "w": 20, "h": 60, "name": "person"}]})";
  const auto path = folder.write("tracker.json", text + "]");
  Scene scene;
  scene.camera = read_camera(folder.write("camera.json", kCamera)).camera;
  TrackStream stream(std::vector{path}, scene, {}, CleanConfig{}, StreamLimits{1000, 4096, 100});
  const auto tracks = stream.next();
  ASSERT_TRUE(tracks);
  ASSERT_EQ(tracks->trajectories.size(), 1U);
  EXPECT_EQ(tracks->trajectories[0].times_s.size(), 200U);
  EXPECT_NEAR(tracks->trajectories[0].positions_m[0].x(), 5.0, 1e-9);
}

TEST(TimeStamps, MayBeDates) {
  const auto file = read_text("dates.csv",
                              "track_id,timestamp,x,y\na,1970-01-02T00:00:00.5Z,1,2\n"
                              "a,1970-01-02 02:00:01+0200,1,2\na,1970-01-02T00:00:02,1,2\n"
                              "a,1970-13-02T00:00:02,1,2\na,1970-01-02T00:00:0x,1,2\n"
                              "a,1970-01-02T00:00:02 Z,1,2\na,1970-01-02T00:00:02+2,1,2\n");
  ASSERT_EQ(file.detections.rows.size(), 3U);
  EXPECT_DOUBLE_EQ(file.detections.rows[0].t_s, 86400.5);
  EXPECT_DOUBLE_EQ(file.detections.rows[1].t_s, 86401.0);
  EXPECT_DOUBLE_EQ(file.detections.rows[2].t_s, 86402.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 4U);
}

}  // namespace
}  // namespace sila
