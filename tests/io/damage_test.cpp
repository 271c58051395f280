#include <gtest/gtest.h>

#include <random>

#include "io/files.hpp"
#include "sila/core/clean.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/track_files.hpp"

// Files damaged at random must be read or rejected as bad files; nothing else may come out, and what is read must be
// sound.

namespace sila {
namespace {

using tests::ScratchFolder;

std::string damaged(std::string text, std::mt19937& random) {
  const std::string pieces[] = {"", ",", "\n", " ", "\"", "nan", "-", "1e999", "{", "}", "#", "\t", "x", "1e308", ";"};
  std::uniform_int_distribution<std::size_t> which(0, std::size(pieces) - 1);
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, text.size())(random);
    const std::size_t cut = std::uniform_int_distribution<std::size_t>(0, 4)(random);
    text.replace(at, std::min(cut, text.size() - at), pieces[which(random)]);
  }
  return text;
}

const std::vector<std::string>& sound_files() {
  static const std::vector<std::string> files = {
      "track_id,t,x,y\n1,0,1,2\n1,0.4,1.5,2\n2,0.4,3,4\n2,0.8,3.5,4\n",
      "0 1 8.5 0 3.5 1.6 0 0.1\n6 1 9 0 3.7 1.6 0 0.3\n12 1 9.5 0 4 1.6 0 0.3\n",
      "0 4 1.5 2.5\n12 4 1.75 2.5\n24 4 2 2.5\n",
      "{\"scene\": {\"fps\": 2.5}}\n{\"track\": {\"f\": 0, \"p\": 3, \"x\": 1.5, \"y\": 2}}\n{\"track\": {\"f\": 10, "
      "\"p\": 3, \"x\": 2, \"y\": 2.5}}\n",
      "0 10 20 12 24 30 0 0 0 \"Pedestrian\"\n0 10 20 12 24 31 0 0 0 \"Pedestrian\"\n",
      "id,frame,label,x_est,y_est,vx_est,vy_est\n0,1,ped,5,9,1,0\n0,2,ped,5.1,9,1,0\n",
      "#framerate: 16\n# id frame x y z\n1 8 3.5 -0.5 1.7\n1 9 3.4 -0.5 1.7\n",
      ",timestamp,x,y\n0,0.0,1,2\n1,0.02,1.1,2\n"};
  return files;
}

TEST(DamagedTrackFiles, AreReadSoundlyOrRejected) {
  const ScratchFolder folder;
  std::size_t read = 0;
  std::size_t rejected = 0;
  for (unsigned seed = 1; seed <= 1600; ++seed) {
    std::mt19937 random(seed);
    const std::string text = damaged(sound_files()[seed % sound_files().size()], random);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ":\n" << text);
    const auto path = folder.write("damaged", text);
    try {
      const TrackFile file = read_detections(path);
      const CleanTracks tracks = clean(std::span(&file.detections, 1), {});
      std::size_t rows = tracks.report.rows_kept;
      for (const DroppedRows& entry : tracks.report.dropped) rows += entry.rows;
      EXPECT_EQ(rows, tracks.report.rows_read);
      for (const Trajectory& track : tracks.trajectories) validate(track);
      ++read;
    } catch (const FormatError& error) {
      EXPECT_EQ(error.path, path.string());
      ++rejected;
    }
  }
  EXPECT_GT(read, 100U);
  EXPECT_GT(rejected, 10U);
}

TEST(DamagedSceneFiles, AreReadSoundlyOrRejected) {
  const ScratchFolder folder;
  const std::string sound =
      "{\"origin\": [1, 2], \"axis_1\": [1, 0], \"axis_2\": [0.5, 0.8], \"sidewalk_width_m\": 2.5, \"corners\": "
      "[{\"name\": \"A\", "
      "\"origin\": [1, 2], \"axis_1\": [1, 0], \"axis_2\": [0, 1], \"sidewalk_width_m\": 2}], \"files\": [{\"path\": "
      "\"a\", \"to_scene\": "
      "{\"a\": 1, \"b\": 0, \"tx\": 3, \"ty\": 4}}]}";
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    std::mt19937 random(seed);
    const std::string text = damaged(sound, random);
    SCOPED_TRACE(testing::Message() << "seed " << seed << ":\n" << text);
    const auto path = folder.write("damaged.json", text);
    try {
      const Scene scene = read_scene(path);
      ASSERT_LT(scene.primary, scene.corners.size());
      for (const Corner& corner : scene.corners) validate(corner.frame);
    } catch (const FormatError& error) {
      EXPECT_EQ(error.path, path.string());
    }
  }
}

}  // namespace
}  // namespace sila
