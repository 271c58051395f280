#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "io/files.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/track_files.hpp"

namespace sila {
namespace {

using tests::ScratchFolder;

TEST(WriteTracksCsv, WritesWhatTheReaderReadsBackBitForBit) {
  const ScratchFolder folder;
  const std::vector<Trajectory> tracks = {{"a", {0.1, 0.3}, {Vector2(1.0 / 3.0, -2e-17), Vector2(1e5 / 7.0, 3.0)}},
                                          {"file,x:2", {1.0 / 7.0}, {Vector2(0.0, 5e-324)}}};
  const auto path = folder.path() / "out.csv";
  write_tracks_csv(path, tracks);
  const auto rows = read_detections(path).detections.rows;
  ASSERT_EQ(rows.size(), 3U);
  std::size_t row = 0;
  for (const Trajectory& track : tracks) {
    for (std::size_t i = 0; i < track.times_s.size(); ++i, ++row) {
      EXPECT_EQ(rows[row].track, track.id);
      EXPECT_EQ(rows[row].t_s, track.times_s[i]);
      EXPECT_EQ(rows[row].position_m, track.positions_m[i]);
    }
  }
}

TEST(WriteTracksCsv, KeepsEachIdOrRefusesIt) {
  const ScratchFolder folder;
  const auto path = folder / "out.csv";
  std::vector<Trajectory> tracks;
  for (const char* id : {"#5", "'x'", "'", " a ", "a\r", "\v", "a'b", "17#2", "a;b"})
    tracks.push_back({id, {0.0}, {Vector2(1, 2)}});
  write_tracks_csv(path, tracks);
  const auto rows = read_detections(path).detections.rows;
  ASSERT_EQ(rows.size(), tracks.size());
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].track, tracks[i].id);
  for (const std::string& id : std::vector<std::string>{"", "a\"b", "a\nb", {"a\0b", 3}}) {
    tracks.front().id = id;
    EXPECT_THROW(write_tracks_csv(path, tracks), std::invalid_argument) << id;
  }
  EXPECT_EQ(read_detections(path).detections.rows.size(), tracks.size());
}

TEST(WriteTracksCsv, LeavesNothingBehindWhenItCannotWrite) {
  const ScratchFolder folder;
  const std::vector<Trajectory> tracks = {{"a", {0.0}, {Vector2(1, 2)}}};
  EXPECT_THROW(write_tracks_csv(folder.path() / "missing" / "out.csv", tracks), FormatError);
  std::filesystem::create_directories(folder.path() / "taken" / "inside");
  EXPECT_THROW(write_tracks_csv(folder.path() / "taken", tracks), FormatError);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "taken.part"));
}

}  // namespace
}  // namespace sila
