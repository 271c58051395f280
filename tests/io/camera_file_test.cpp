// Cameras: files of them, and what they make of boxes in pixels.

#include <gtest/gtest.h>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "sila/core/clean.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/io/track_files.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::at_rate;
using tests::format_error_of;
using tests::kCamera;
using tests::rows_of;
using tests::ScratchFolder;

TEST(CameraFile, MakesMetresOfBoxesAndDropsThoseAboveTheHorizon) {
  const ScratchFolder folder;
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
  const ScratchFolder folder;
  const auto path = folder.write("s.json", R"({"origin": [0, 0], "axis_1": [1, 0], "axis_2": [0, 1],
    "sidewalk_width_m": 3, "camera": )" + std::string(kCamera) +
                                               "}");
  const Scene scene = read_scene(path);
  ASSERT_TRUE(scene.camera);
  const auto mot = folder.write("mot.txt", "0,1,-5,900,10,100,1,-1,-1,-1\n1,1,-4,900,10,100,1,-1,-1,-1\n");
  const CleanTracks tracks = read_tracks(std::vector{mot}, scene, at_rate(10.0), CleanConfig{});
  EXPECT_NEAR(tracks.trajectories.at(0).positions_m.at(1).x(), 0.01, 1e-9);
  write_scene(folder / "again.json", scene);
  const Scene again = read_scene(folder / "again.json");
  EXPECT_NEAR((again.camera->ground_from_image - scene.camera->ground_from_image).norm(), 0.0, 1e-12);
}

TEST(CameraFile, KeepsTheSignOfItsCameraInASavedScene) {
  Scene scene;
  scene.corners.emplace_back();
  scene.camera.emplace();
  for (const Eigen::RowVector3d& w : {Eigen::RowVector3d(0, 0, 1), Eigen::RowVector3d(0, -1e-19, 1),
                                      Eigen::RowVector3d(0, 1e-3, -0.5), Eigen::RowVector3d(-1e-3, -1e-3, 0)}) {
    scene.camera->ground_from_image << 0.01, 0, 1, 0, 0.01, 1, w;
    const ScratchFolder folder;
    write_scene(folder / "s.json", scene);
    const Scene again = read_scene(folder / "s.json");
    EXPECT_EQ(again.camera->ground_from_image, scene.camera->ground_from_image) << w;
  }
}

TEST(Pixels, AreNoTracksWithoutACameraOrAScale) {
  const ScratchFolder folder;
  const auto mot = folder.write("mot.txt", "0,1,-5,900,10,100,1,-1,-1,-1\n1,1,-4,900,10,100,1,-1,-1,-1\n");
  const auto frigate = folder.write(
      "events.jsonl", R"({"after": {"id": "a", "frame_time": 1, "label": "person", "box": [100, 50, 140, 170]}})"
                      "\n"
                      R"({"after": {"id": "a", "frame_time": 1.5, "label": "person", "box": [101, 50, 141, 170]}})");
  ReadOptions options = at_rate(10.0);
  for (const auto& path : {mot, frigate}) {
    const std::vector files{path};
    options.metres_per_unit = std::nullopt;
    const auto read = format_error_of([&] { read_tracks(files, {}, options, CleanConfig{}); });
    const auto in_parts = format_error_of([&] { TrackStream(files, {}, options, CleanConfig{}).next(); });
    for (const auto& error : {read, in_parts}) {
      EXPECT_TRUE(says(error.what(), "expected positions in metres, found pixels; give --camera")) << path;
    }
    EXPECT_TRUE(read_detections(path, options).pixels) << "its caller decides";
    options.metres_per_unit = 0.01;
    EXPECT_EQ(read_tracks(files, {}, options, CleanConfig{}).trajectories.size(), 1U);
  }
}

TEST(CameraFile, WarnsOfLargeResidualsAndNamesTheFileOfWrongOnes) {
  const ScratchFolder folder;
  const std::string six =
      R"({"image_points": [[0,1000],[1000,1000],[400,500],[600,500],[500,700],[500,1000]],
          "ground_points": [[0,0],[10,0],[0,20],[10,20],[5,12],[5,4]]})";
  const CameraFile read = read_camera(folder.write("six.json", six));
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_TRUE(says(read.warnings[0], "pair "));
  for (const char* text :
       {R"({"image_points": [[0, 0]], "ground_points": [[0, 0]]})", R"({"image_points": [[0, 0]]})",
        R"({"image_points": [[0, "a"]], "ground_points": []})", R"({"homography": [[1, 0, 0], [0, 1, 0]]})",
        R"({"homography": [[1, 0, 0], [0, 1, 0], [0, 0, 0]]})", R"({"homography": 3})", "[1, 2]"}) {
    const auto error = format_error_of([&] { read_camera(folder.write("bad.json", text)); });
    EXPECT_TRUE(says(error.what(), "bad.json")) << text;
  }
  for (const char* text : {"{}", R"({"homography": [[1,0,0],[0,1,0],[0,0,1]], "image_points": [[0, 0]]})"}) {
    const auto error = format_error_of([&] { read_camera(folder.write("bad.json", text)); });
    EXPECT_TRUE(says(error.what(), "or a homography")) << text;
  }
}

}  // namespace
}  // namespace sila
