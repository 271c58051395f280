#include <gtest/gtest.h>

#include "io/files.hpp"
#include "sila/io/scene_tracks.hpp"
#include "support/data.hpp"
#include "support/message_of.hpp"

// The recordings are not part of this repository; without them these tests are skipped. Expected numbers of ids are
// those that the recordings' own documentation states; tracklets differ where gaps and jumps split tracks.

namespace sila {
namespace {

struct Recording {
  const char* path;
  TrackFormat format;
  std::size_t ids;
  std::size_t tracks;
};

class RealTracks : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto found = testing::recordings();
    if (!found) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
    data = *found;
  }
  std::filesystem::path data;
};

std::size_t rows_dropped(const TrackReport& report) {
  std::size_t rows = 0;
  for (const DroppedRows& entry : report.dropped) rows += entry.rows;
  return rows;
}

TEST_F(RealTracks, AreRecognisedCountedAndWithoutDoubtsOfTheirUnits) {
  const std::vector<Recording> recordings = {
      {"vru/pedestrians", TrackFormat::vru, 1068, 1068},
      {"juelich_corner/traj.txt", TrackFormat::juelich, 137, 137},
      {"sind/Changchun/Ped_smoothed_tracks.csv", TrackFormat::sind, 49, 49},
      {"sind/Xian/Ped_smoothed_tracks.csv", TrackFormat::sind, 16, 16},
      {"eth_ucy/eth/obsmat.txt", TrackFormat::obsmat, 360, 360},
      {"eth_ucy/hotel/obsmat.txt", TrackFormat::obsmat, 390, 389},  // one id has a single row
      {"eth_ucy/zara01/obsmat.txt", TrackFormat::obsmat, 148, 148},
      {"eth_ucy/zara02/obsmat.txt", TrackFormat::obsmat, 204, 204},
      {"eth_ucy/students03/obsmat.txt", TrackFormat::obsmat, 428, 428},
      {"eth_ucy/sgan_format/biwi_eth.txt", TrackFormat::frame_id_x_y, 360, 360},
      {"trajnetpp/biwi_hotel.ndjson", TrackFormat::trajnetpp, 263, 261},  // two ids have a single row
      {"trajnetpp/crowds_zara01.ndjson", TrackFormat::trajnetpp, 148, 148},
      {"trajnetpp/crowds_zara03.ndjson", TrackFormat::trajnetpp, 137, 139},  // three gaps, one tracklet of a single row
      {"sdd/derived_stitched/deathCircle_1.txt", TrackFormat::frame_id_x_y, 285, 285},
      {"sdd/derived_stitched/gates_3.txt", TrackFormat::frame_id_x_y, 121, 121},
  };
  for (const Recording& recording : recordings) {
    SCOPED_TRACE(recording.path);
    const TrackFile file = read_detections(data / recording.path);
    EXPECT_EQ(file.format, recording.format);
    const CleanTracks tracks = clean(std::span(&file.detections, 1), {});
    EXPECT_EQ(tracks.report.track_ids, recording.ids);
    EXPECT_EQ(tracks.trajectories.size(), recording.tracks);
    EXPECT_EQ(tracks.report.rows_read, tracks.report.rows_kept + rows_dropped(tracks.report));
    EXPECT_TRUE(tracks.report.warnings.empty()) << tracks.report.warnings.front();
    for (const Trajectory& track : tracks.trajectories) validate(track);
  }
}

TEST_F(RealTracks, HaveTheClockOfTheirDocumentation) {
  const auto first_step = [&](const char* path) {
    const auto file = read_detections(data / path);
    const auto tracks = clean(std::span(&file.detections, 1), {});
    return tracks.trajectories.front().times_s[1] - tracks.trajectories.front().times_s[0];
  };
  for (const char* path :
       {"eth_ucy/eth/obsmat.txt", "eth_ucy/hotel/obsmat.txt", "eth_ucy/students03/obsmat.txt",
        "eth_ucy/sgan_format/biwi_eth.txt", "trajnetpp/biwi_hotel.ndjson", "sdd/derived_stitched/nexus_1.txt"}) {
    EXPECT_NEAR(first_step(path), 0.4, 1e-9) << path;
  }
  EXPECT_NEAR(first_step("juelich_corner/traj.txt"), 1.0 / 16.0, 1e-9);
  EXPECT_NEAR(first_step("dut/trajectories_filtered/intersection_05_traj_ped_filtered.csv.gz"), 1.0 / 23.98, 1e-9);
  EXPECT_NEAR(first_step("sind/Xian/Ped_smoothed_tracks.csv"), 0.1001, 1e-4);
}

TEST_F(RealTracks, OfEveryPlaceAreReadThroughTheirScene) {
  struct ExpectedSite {
    const char* scene;
    std::size_t ids, corners;
  };
  for (const ExpectedSite& place : {ExpectedSite{"vru_aschaffenburg", 1068, 1},
                                    ExpectedSite{"dut_intersection", 774, 4}, ExpectedSite{"sdd_deathCircle", 674, 4},
                                    ExpectedSite{"sdd_gates", 231, 3}, ExpectedSite{"sind_changchun", 49, 4},
                                    ExpectedSite{"sind_xian", 16, 4}, ExpectedSite{"juelich_corner", 137, 1}}) {
    SCOPED_TRACE(place.scene);
    const Scene scene = read_scene(data / "scenes" / (std::string(place.scene) + ".json"));
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.corners.size(), place.corners);
    const CleanTracks tracks = read_tracks({}, scene, {}, {});
    EXPECT_EQ(tracks.report.track_ids, place.ids);
    EXPECT_TRUE(tracks.report.warnings.empty());
  }
}

TEST_F(RealTracks, OfSeveralVideosFallOnOneAnother) {
  // gates_1 is turned by 91 degrees against gates_3: placed right, the two clouds of positions share their middle.
  const Scene scene = read_scene(data / "scenes/sdd_gates.json");
  const CleanTracks tracks = read_tracks({}, scene, {}, {});
  std::vector<Vector2> middle(2, Vector2::Zero());
  std::vector<double> count(2, 0.0);
  for (std::size_t i = 0; i < tracks.trajectories.size(); ++i) {
    if (tracks.trajectories[i].recording > 1) continue;
    for (const Vector2& p : tracks.trajectories[i].positions_m) {
      middle[tracks.trajectories[i].recording] += p;
      count[tracks.trajectories[i].recording] += 1.0;
    }
  }
  EXPECT_LT((middle[0] / count[0] - middle[1] / count[1]).norm(), 12.0);
}

TEST_F(RealTracks, OfTheExperimentScenesAreFoundInTheDataFolder) {
  std::size_t scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(tests::scenes_of_experiments())) {
    SCOPED_TRACE(entry.path().string());
    const Scene scene = read_scene(entry.path(), data);
    const CleanTracks tracks = read_tracks({}, scene, {}, {});
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_TRUE(tracks.report.warnings.empty());
    EXPECT_GE(tracks.trajectories.size(), 10U);
    ++scenes;
  }
  EXPECT_GE(scenes, 16U);
}

TEST_F(RealTracks, InPixelsAreDoubtedAsDroneAnnotationsAndAsPlainCsv) {
  for (const char* video : {"deathCircle/video2", "deathCircle/video4", "gates/video2", "gates/video4", "gates/video5",
                            "gates/video8", "nexus/video4", "nexus/video10"}) {
    SCOPED_TRACE(video);
    TrackFile file = read_detections(data / "sdd/raw_30fps" / video / "annotations.txt.gz");
    EXPECT_EQ(file.format, TrackFormat::stanford_drone);
    ASSERT_EQ(file.detections.warnings.size(), 1U);
    file.detections.warnings.clear();  // what remains is the warning that any format gets
    const CleanTracks tracks = clean(std::span(&file.detections, 1), {});
    ASSERT_EQ(tracks.report.warnings.size(), 1U);
    EXPECT_TRUE(says(tracks.report.warnings[0], "look like pixels"));
  }
}

}  // namespace
}  // namespace sila
