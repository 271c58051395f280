#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "io/files.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/scene_tracks.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::ScratchFolder;

/// So small that every file is read in parts.
constexpr StreamLimits kTiny{.whole_bytes = 0, .block_bytes = 256, .rows_at_once = 60};

enum class Order { by_track, by_time, shuffled };

/// 40 people who come and go, with rows that are no rows among theirs.
std::string rows_text(Order order, unsigned seed, const std::string& line_end) {
  std::mt19937 random(seed);
  struct Row {
    int track;
    double t_s;
    std::string text;
  };
  std::vector<Row> rows;
  for (int track = 0; track < 40; ++track) {
    const double start_s = static_cast<double>(random() % 900) / 10.0;
    const auto samples = 2 + random() % 30;
    for (unsigned i = 0; i < samples; ++i) {
      const double t_s = start_s + 0.1 * i;
      const std::string x = random() % 50 == 0 ? "oops" : std::to_string(0.12 * i + track);
      rows.push_back({track, t_s, std::to_string(track) + "," + std::to_string(t_s) + "," + x + ",1.5"});
    }
  }
  if (order == Order::by_time) std::ranges::stable_sort(rows, {}, &Row::t_s);
  if (order == Order::shuffled) std::ranges::shuffle(rows, random);
  std::string text = "# made up" + line_end + "track_id,t,x,y" + line_end;
  for (const Row& row : rows) text += row.text + line_end + (random() % 40 == 0 ? "# a remark" + line_end : "");
  return text;
}

struct Streamed {
  CleanTracks tracks;
  int parts = 0;
};

Streamed all_of(TrackStream stream) {
  Streamed all;
  EXPECT_FALSE(stream.exhausted());
  while (auto part = stream.next()) {
    ++all.parts;
    std::ranges::move(part->trajectories, std::back_inserter(all.tracks.trajectories));
    std::ranges::move(part->input_ids, std::back_inserter(all.tracks.input_ids));
  }
  EXPECT_TRUE(stream.exhausted());
  all.tracks.report = stream.report();
  return all;
}

/// Without the example that is named of each reason: which of the rows comes first depends on the order of reading.
std::vector<std::string> counts(const TrackReport& report) {
  std::vector<std::string> lines = to_lines(report);
  for (std::string& line : lines) line = line.substr(0, line.find(" (first:"));
  return lines;
}

void expect_same(const CleanTracks& streamed, const CleanTracks& whole) {
  ASSERT_EQ(streamed.trajectories.size(), whole.trajectories.size());
  for (std::size_t i = 0; i < whole.trajectories.size(); ++i) {
    EXPECT_EQ(streamed.trajectories[i].id, whole.trajectories[i].id);
    EXPECT_EQ(streamed.trajectories[i].times_s, whole.trajectories[i].times_s);
    EXPECT_EQ(streamed.trajectories[i].positions_m, whole.trajectories[i].positions_m);
    EXPECT_EQ(streamed.trajectories[i].recording, whole.trajectories[i].recording);
  }
  EXPECT_EQ(streamed.input_ids, whole.input_ids);
  EXPECT_EQ(counts(streamed.report), counts(whole.report));
}

TEST(TrackStream, GivesWhatReadingTheWholeFileGives) {
  const ScratchFolder folder;
  for (const Order order : {Order::by_track, Order::by_time, Order::shuffled}) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      SCOPED_TRACE(seed);
      const auto path = folder.write(
          "a.csv", (seed % 3 == 0 ? "\xEF\xBB\xBF" : "") + rows_text(order, seed, seed % 2 == 0 ? "\n" : "\r\n"));
      const Streamed streamed = all_of(TrackStream({{path}}, {}, {}, {}, kTiny));
      EXPECT_GT(streamed.parts, 5);
      expect_same(streamed.tracks, read_tracks({{path}}, {}, {}, {}));
    }
  }
}

TEST(TrackStream, NamesTheTracksOfSeveralFilesAsReadTracksDoes) {
  const ScratchFolder folder;
  const std::vector<std::filesystem::path> paths{folder.write("a.csv", rows_text(Order::by_time, 1, "\n")),
                                                 folder.write("b.csv", rows_text(Order::by_track, 2, "\n"))};
  StreamLimits only_the_first_in_parts = kTiny;
  only_the_first_in_parts.whole_bytes = std::filesystem::file_size(paths[0]) - 1;
  ASSERT_LT(std::filesystem::file_size(paths[1]), std::filesystem::file_size(paths[0]));
  expect_same(all_of(TrackStream(paths, {}, {}, {}, only_the_first_in_parts)).tracks, read_tracks(paths, {}, {}, {}));
}

TEST(TrackStream, ReadsFormatsWithAFrameRateInPartsAndOthersWhole) {
  const ScratchFolder folder;
  std::string dut = "id,frame,label,x_est,y_est\n";
  std::string obsmat;
  for (int id = 1; id <= 30; ++id) {
    for (int frame = 0; frame < 6; ++frame) {
      const std::string x = std::to_string(0.1 * frame + id);
      dut += std::to_string(id) + "," + std::to_string(10 * id + frame) + ",ped," + x + ",2\n";
      obsmat += std::to_string(10 * (10 * id + frame)) + " " + std::to_string(id) + " " + x + " 0 2 0 0 0\n";
    }
  }
  const auto framed = folder.write("dut.csv", dut);
  const Streamed in_parts = all_of(TrackStream({{framed}}, {}, {}, {}, kTiny));
  EXPECT_GT(in_parts.parts, 1);
  expect_same(in_parts.tracks, read_tracks({{framed}}, {}, {}, {}));
  const auto annotated = folder.write("obsmat.txt", obsmat);
  const Streamed whole = all_of(TrackStream({{annotated}}, {}, {}, {}, kTiny));
  EXPECT_EQ(whole.parts, 1);
  expect_same(whole.tracks, read_tracks({{annotated}}, {}, {}, {}));
}

TEST(TrackStream, RejectsEveryFileBeforeTheFirstTrackIsGiven) {
  const ScratchFolder folder;
  const auto good = folder.write("a.csv", rows_text(Order::by_time, 1, "\n"));
  const std::vector<std::filesystem::path> second_is_none{good, folder.write("b.csv", "a,b\n1,2\n")};
  EXPECT_THROW(TrackStream(second_is_none, {}, {}, {}), FormatError);
  const std::vector<std::filesystem::path> second_is_missing{good, good.parent_path() / "none.csv"};
  EXPECT_THROW(TrackStream(second_is_missing, {}, {}, {}), FormatError);
}

TEST(TrackStream, RejectsALineLongerThanABlockWithItsNumber) {
  const ScratchFolder folder;
  const std::string text = "track_id,t,x,y\n1,0,0,0\n1,0.1,0,0\n" + std::string(300, 'x') + "\n";
  const auto read = [&] { all_of(TrackStream({{folder.write("a.csv", text)}}, {}, {}, {}, kTiny)); };
  EXPECT_TRUE(says(message_of<FormatError>(read), ":4:"));
}

TEST(TrackStream, RejectsFilesWithoutOneTrack) {
  const ScratchFolder folder;
  const auto path = folder.write("a.csv", "track_id,t,x,y\n1,0,0,0\n2,0.1,0,0\n" + std::string(40, '\n'));
  EXPECT_THROW(all_of(TrackStream({{path}}, {}, {}, {}, kTiny)), FormatError);
}

}  // namespace
}  // namespace sila
