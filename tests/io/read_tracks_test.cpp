#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "sila/io/track_files.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::expect_row;
using tests::read_text;
using tests::rows_of;
using tests::ScratchFolder;
using tests::write_gz;

TEST(GenericCsv, ReadsTheColumnsByNameAndIgnoresOthers) {
  const auto file = read_text("a.csv", "speed,track_id,t,x,y,note\n1,p 7,0.5,1.25,-2,hi\n1,p 7,1.0,1.5,-3,\n");
  EXPECT_EQ(file.format, TrackFormat::csv);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "p 7", 0.5, 1.25, -2.0);
  EXPECT_EQ(file.detections.rows[1].line, 3U);
  EXPECT_EQ(file.detections.rows_read, 2U);
}

TEST(GenericCsv, AcceptsAliasesSeparatorsQuotesByteOrderMarkAndCrLf) {
  for (const char* text : {"id,time,x,y\r\n3,0.5,1,2\r\n", "\xEF\xBB\xBFPed_ID;Timestamp;X_m;Y_m\n3;0.5;1;2\n",
                           "agent_id\tseconds\tpos_x\tpos_y\n3\t0.5\t1\t2\n",
                           "\"object_id\",\"t_s\",\"position_x\",\"position_y\"\n\"3\",\"0.5\",\"+1\",\"2\"\n",
                           "pedestrian_id timestamp_ms x y\n3 500 1 2\n", "track_id,t_ns,x,y\n3,500000000,1,2\n",
                           "# made by hand\n\ntrack_id , t , x , y\n 3 , 5e-1 , 1.0 , 2.0\n"}) {
    SCOPED_TRACE(text);
    const auto file = read_text("a.csv", text);
    ASSERT_EQ(file.detections.rows.size(), 1U);
    expect_row(file.detections.rows[0], "3", 0.5, 1.0, 2.0);
  }
}

TEST(GenericCsv, KeepsASeparatorInsideQuotes) {
  const auto file = read_text("a.csv", "track_id,t,x,y\n\"a,b\",0,1,2\n");
  expect_row(file.detections.rows.at(0), "a,b", 0.0, 1.0, 2.0);
}

TEST(GenericCsv, TakesTheClassesThatAreNamedInAnyCase) {
  const std::string text = "track_id,t,x,y,label\n1,0,1,2,Cyclist\n2,0,1,2,CYCLIST\n3,0,1,2,person\n";
  const auto rows = read_text("t.csv", text, {.person_classes = {"Cyclist"}}).detections.rows;
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].label, "person");
  EXPECT_EQ(rows[1].label, "person");
  EXPECT_EQ(rows[2].label, "not asked for: person");
}

TEST(GenericCsv, TurnsFramesIntoSecondsByTheRateOrTheInterval) {
  const std::string text = "track_id,frame,x,y\n1,5,0,0\n1,10,1,0\n1,15,2,0\n1,25,3,0\n";
  EXPECT_DOUBLE_EQ(read_text("a.csv", text, {.frames_per_second = 25.0}).detections.rows[1].t_s, 0.4);
  EXPECT_DOUBLE_EQ(read_text("a.csv", text, {.sample_interval_s = 0.5}).detections.rows[1].t_s, 1.0);
  const auto error = tests::format_error_of([&] { read_text("a.csv", text); });
  EXPECT_TRUE(says(error.expected, "frames_per_second"));
}

TEST(GenericCsv, WarnsOfColumnsThatAreNotUsed) {
  const auto warning = [&](const std::string& header, const std::string& row) {
    const auto warnings = read_text("t.csv", header + row, {.frames_per_second = 10.0}).detections.warnings;
    return warnings.empty() ? std::string() : warnings.front();
  };
  EXPECT_EQ(warning("frame,personId,x,y,type\n", "1,7,2,3,car\n"), "");
  EXPECT_EQ(warning("timestamp,x,y,label\n", "1,2,3,person\n"), "");
  EXPECT_TRUE(says(warning("timestamp,walker,x,y\n", "1,7,2,3\n"), "no column of track ids"));
  EXPECT_TRUE(says(warning("frame,id,x,y,w,h\n", "1,7,2,3,4,5\n"), "widths and heights are not used"));
}

TEST(GenericCsv, BoxesWithoutATrackAreCounted) {
  const Detections read = read_text("t.csv", "frame,id,x1,y1,x2,y2\n1,-1,2,3,4,5\n1,7,2,3,4,5\n",
                                    {.frames_per_second = 10.0, .metres_per_unit = 1.0})
                              .detections;
  EXPECT_EQ(read.rows.size(), 1u);
  ASSERT_EQ(read.dropped.size(), 1u);
  EXPECT_EQ(read.dropped.front().reason, DropReason::missing_cells);
}

TEST(GenericCsv, PrefersTimeStampsToFrames) {
  const auto file = read_text("a.csv", "track_id,frame,t,x,y\n1,50,0.7,0,0\n", {.frames_per_second = 25.0});
  EXPECT_DOUBLE_EQ(file.detections.rows[0].t_s, 0.7);
}

TEST(GenericCsv, ScalesToMetres) {
  const auto file = read_text("a.csv", "track_id,t,x,y\n1,0,100,200\n", {.metres_per_unit = 0.05});
  expect_row(file.detections.rows[0], "1", 0.0, 5.0, 10.0);
}

TEST(GenericCsv, CountsBadRowsByReasonWithTheFirstLine) {
  const auto file =
      read_text("a.csv", "track_id,t,x,y\n1,0,1,2\n1,oops,1,2\n1,1\n1,1,,2\n,1,1,2\n1,2,nan,2\n1,3,1,2,9\n");
  EXPECT_EQ(file.detections.rows_read, 7U);
  EXPECT_EQ(file.detections.rows.size(), 2U);  // NaN is a number to the reader; `clean` rejects it
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 2U);
  EXPECT_EQ(rows_of(file.detections, DropReason::missing_cells), 2U);
  EXPECT_EQ(rows_of(file.detections, DropReason::extra_cells), 1U);
  for (const DroppedRows& entry : file.detections.dropped) {
    const char* line = entry.reason == DropReason::not_a_number    ? ":3"
                       : entry.reason == DropReason::missing_cells ? ":4"
                                                                   : ":8";
    EXPECT_TRUE(says(entry.first, line));
  }
}

TEST(GenericCsv, DropsRowsWithMoreCellsThanNamesButNotWithASeparatorAtTheirEnd) {
  const auto commas = read_text("a.csv", "track_id,t,x,y\n1,10,6,-6,16\n1,10,7,-6,17\n1,9,1,2\n");
  EXPECT_EQ(rows_of(commas.detections, DropReason::extra_cells), 2U);
  EXPECT_EQ(read_text("b.csv", "track_id,t,x,y\n1,10,6,-6,\n").detections.rows.size(), 1U);
  const auto semicolons = read_text("c.csv", "track_id;t;x;y\n1;10,6;1;2\n1;10;1;2\n");
  EXPECT_TRUE(says(semicolons.detections.dropped.at(0).first, "\"10,6\"; numbers need a decimal point"));
}

TEST(GenericCsv, NamesTheRemedyForOtherEncodingsAndLineEnds) {
  const auto rejection = [&](const std::string& text) {
    return message_of<FormatError>([&] { read_text("a.csv", text); });
  };
  EXPECT_TRUE(says(rejection(std::string("\xff\xfet\0,\0x\0", 8)), "save it as UTF-8"));
  EXPECT_TRUE(says(rejection("track_id,t,x,y\r1,0,1,2\r1,1,1,2\r"), "line ends of CR alone"));
}

TEST(GenericCsv, IsReadTheSameInALocaleWithDecimalCommas) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  const ScratchFolder folder;
  const std::string make = "localedef --no-archive -i de_DE -f UTF-8 " + (folder / "de_DE.UTF-8").string();
  if (std::system(make.c_str()) != 0) GTEST_SKIP() << "the package locales is missing";
  setenv("LOCPATH", folder.path().c_str(), 1);
  ASSERT_NE(std::setlocale(LC_ALL, "de_DE.UTF-8"), nullptr);
  ASSERT_STREQ(std::localeconv()->decimal_point, ",");
  const auto file = read_text("a.csv", "track_id,t,x,y\n1,0.25,1.5,2\n");
  std::setlocale(LC_ALL, before.c_str());
  unsetenv("LOCPATH");
  expect_row(file.detections.rows[0], "1", 0.25, 1.5, 2.0);
}

TEST(Obsmat, TakesTheThirdAndFifthColumnAndFindsTheFrameStep) {
  const auto file = read_text(
      "obsmat.txt", "  7.800e+02 1.000e+00 8.5 0.0 3.5 1.6 0.0 0.1\r\n  7.860e+02 1.0 9.0 0.0 3.75 1.6 0.0 0.3\n");
  EXPECT_EQ(file.format, TrackFormat::obsmat);
  expect_row(file.detections.rows[0], "1", 52.0, 8.5, 3.5);
  expect_row(file.detections.rows[1], "1", 52.4, 9.0, 3.75);
}

TEST(FrameIdXY, ReadsSpacesAndTabs) {
  const auto file = read_text("a.txt", "0 4 1.5 2.5\n12\t4.0\t1.75\t2.5\n24 4 2 2.5\n48 4 3 2.5\n");
  EXPECT_EQ(file.format, TrackFormat::frame_id_x_y);
  expect_row(file.detections.rows[1], "4", 0.4, 1.75, 2.5);
  EXPECT_DOUBLE_EQ(file.detections.rows[3].t_s, 1.6);
}

TEST(FrameIdXY, IsRecognisedDespiteADamagedFirstRow) {
  const auto file = read_text("a.txt", "0 4 ? 2.5\n10 4 1 2\n20 4 2 2\n");
  EXPECT_EQ(file.format, TrackFormat::frame_id_x_y);
  EXPECT_EQ(file.detections.rows.size(), 2U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
}

TEST(StanfordDrone, TakesBoxCentresInPixelsAndCountsLostRows) {
  const ScratchFolder folder;
  const auto path = folder.write("annotations.txt",
                                 "0 100 200 120 240 30 0 0 0 \"Pedestrian\"\n0 100 200 120 240 31 1 0 0 "
                                 "\"Pedestrian\"\n1 0 0 9 9 30 0 0 0 \"Biker\"\n");
  const auto file = read_detections(path, {.metres_per_unit = 0.05});
  EXPECT_EQ(file.format, TrackFormat::stanford_drone);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "0", 1.0, 5.5, 11.0);
  EXPECT_EQ(file.detections.rows[1].label, "Biker");
  EXPECT_EQ(rows_of(file.detections, DropReason::lost), 1U);
  EXPECT_TRUE(file.detections.warnings.empty());
  ASSERT_EQ(read_detections(path).detections.warnings.size(), 1U);
  EXPECT_TRUE(says(read_detections(path).detections.warnings[0], "pixels"));
}

class IndRecording : public ::testing::Test {
 protected:
  ScratchFolder folder;
  std::filesystem::path tracks = folder.write("07_tracks.csv",
                                              "recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,"
                                              "length\n7,0,50,0,10.5,-4.5,90,0,0\n7,1,50,0,3,-3,0,2,4\n");
  void write_classes() const {
    folder.write("07_tracksMeta.csv",
                 "recordingId,trackId,initialFrame,finalFrame,numFrames,width,length,class\n7,0,50,51,2,0,0,"
                 "pedestrian\n7,1,50,51,2,2,4,car\n");
  }
};

TEST_F(IndRecording, JoinsClassesAndFrameRateFromTheMetaFiles) {
  write_classes();
  folder.write("07_recordingMeta.csv", "recordingId,locationId,frameRate,speedLimit\n7,1,25,13.9\n");
  const auto file = read_detections(tracks);
  EXPECT_EQ(file.format, TrackFormat::ind);
  expect_row(file.detections.rows[0], "0", 2.0, 10.5, -4.5);
  EXPECT_EQ(file.detections.rows[0].label, "pedestrian");
  EXPECT_EQ(file.detections.rows[1].label, "car");
}

TEST_F(IndRecording, IsRejectedWithoutTheClasses) {
  const auto error = tests::format_error_of([&] { read_detections(tracks); });
  EXPECT_TRUE(says(error.expected, "NN_tracksMeta.csv"));
}

TEST_F(IndRecording, NeedsAFrameRateFromTheMetaFileOrTheCaller) {
  write_classes();
  EXPECT_TRUE(says(tests::format_error_of([&] { read_detections(tracks); }).expected, "frame rate"));
  EXPECT_DOUBLE_EQ(read_detections(tracks, {.frames_per_second = 50.0}).detections.rows[0].t_s, 1.0);
}

TEST(Sind, UsesItsMilliseconds) {
  const auto file = read_text(
      "a.csv", "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,ax,ay\nP0,5,500.5,pedestrian,-4,8,0,0,0,0\n");
  EXPECT_EQ(file.format, TrackFormat::sind);
  expect_row(file.detections.rows[0], "P0", 0.5005, -4.0, 8.0);
  EXPECT_EQ(file.detections.rows[0].label, "pedestrian");
}

TEST(Dut, CountsFramesAtItsOwnRate) {
  const ScratchFolder folder;
  const auto file =
      read_detections(write_gz(folder / "a.csv.gz", "id,frame,label,x_est,y_est,vx_est,vy_est\n0,2398,ped,5,9,1,0\n"));
  EXPECT_EQ(file.format, TrackFormat::dut);
  expect_row(file.detections.rows[0], "0", 100.0, 5.0, 9.0);
  EXPECT_EQ(file.detections.rows[0].label, "ped");
}

TEST(Vru, MakesAFolderOneRecordingWithPathsAsIds) {
  const ScratchFolder folder;
  folder.write("set/moving/b.csv", ",timestamp,x,y\n0,0.0,1,2\n1,0.02,1.5,2\n");
  folder.write("set/moving/a.csv", ",timestamp,x,y\n0,0.0,5,6\n");
  folder.write("set/waiting/a.csv", ",timestamp,x,y\n0,0.0,7,8\n1,x,7,8\n");
  const auto file = read_detections(folder.path() / "set");
  EXPECT_EQ(file.format, TrackFormat::vru);
  ASSERT_EQ(file.detections.rows.size(), 4U);
  expect_row(file.detections.rows[0], "moving/a.csv", 0.0, 5.0, 6.0);
  expect_row(file.detections.rows[2], "moving/b.csv", 0.02, 1.5, 2.0);
  expect_row(file.detections.rows[3], "waiting/a.csv", 0.0, 7.0, 8.0);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(file.detections.rows_read, 5U);
}

TEST(Vru, ReadsOneFileAsOneTrack) {
  const auto file = read_text("17.csv", ",timestamp,x,y\n0,0.0,1,2\n");
  expect_row(file.detections.rows[0], "17", 0.0, 1.0, 2.0);
}

TEST(Vru, TellsOfFilesInTheFolderThatItSkips) {
  const ScratchFolder folder;
  folder.write("a.csv", ",timestamp,x,y\n0,0.0,1,2\n");
  folder.write("notes.txt", "hello\n");
  const auto file = read_detections(folder.path());
  ASSERT_EQ(file.detections.warnings.size(), 1U);
  EXPECT_TRUE(says(file.detections.warnings[0], "1 of 2 files skipped"));
  EXPECT_TRUE(says(file.detections.warnings[0], "notes.txt"));
}

TEST(Juelich, ReadsTheRateAndTheUnitFromTheComments) {
  const auto metres = read_text("a.txt", "#framerate: 16\n# ID\tframe\tX\tY\tZ\n1\t8\t3.5\t-0.5\t1.7\n");
  EXPECT_EQ(metres.format, TrackFormat::juelich);
  expect_row(metres.detections.rows[0], "1", 0.5, 3.5, -0.5);
  const auto centimetres = read_text("b.txt", "# framerate: 25.00 fps\n# id frame x/cm y/cm z/cm\n1 50 350 -50 170\n");
  expect_row(centimetres.detections.rows[0], "1", 2.0, 3.5, -0.5);
  const auto flat = read_text("c.txt", "# framerate: 10\n# id frame x y\n1 50 3 4\n");
  expect_row(flat.detections.rows[0], "1", 5.0, 3.0, 4.0);
}

TEST(Juelich, NeedsAFrameRate) {
  const std::string text = "1 8 3.5 -0.5 1.7\n";
  EXPECT_TRUE(says(tests::format_error_of([&] { read_text("a.txt", text); }).expected, "frame rate"));
  EXPECT_DOUBLE_EQ(read_text("a.txt", text, {.frames_per_second = 16.0}).detections.rows[0].t_s, 0.5);
}

TEST(ReadDetections, ReadsGzippedFilesAsThePlainOnes) {
  const ScratchFolder folder;
  const std::string text = "track_id,t,x,y\n1,0,1,2\n1,1,2,3\n";
  const auto plain = read_detections(folder.write("a.csv", text)).detections;
  const auto zipped = read_detections(write_gz(folder / "a.csv.gz", text)).detections;
  ASSERT_EQ(plain.rows.size(), zipped.rows.size());
  for (std::size_t i = 0; i < plain.rows.size(); ++i) EXPECT_EQ(plain.rows[i].position_m, zipped.rows[i].position_m);
}

TEST(ReadDetections, ObeysAForcedFormat) {
  const std::string text = "1 16 3.5 -0.5\n";
  const auto file = read_text("a.txt", text, {.format = TrackFormat::juelich, .frames_per_second = 16.0});
  expect_row(file.detections.rows[0], "1", 1.0, 3.5, -0.5);
  const auto error = tests::format_error_of([&] { read_text("a.txt", text, {.format = TrackFormat::dut}); });
  EXPECT_TRUE(says(error.expected, "x_est"));
  EXPECT_EQ(error.line, 1U);
}

TEST(ReadDetections, KnowsEveryFormatByItsName) {
  ASSERT_EQ(track_formats().size(), 19U);
  for (const TrackFormatText& format : track_formats()) {
    EXPECT_EQ(track_format(format.name), format.format);
    EXPECT_EQ(name_of(format.format), format.name);
  }
  EXPECT_EQ(track_format("parquet"), std::nullopt);
}

TEST(ReadDetections, RejectsOptionsThatAreNotPositive) {
  const std::string text = "track_id,t,x,y\n1,0,1,2\n";
  EXPECT_THROW(read_text("a.csv", text, {.frames_per_second = 0.0}), std::invalid_argument);
  EXPECT_THROW(read_text("a.csv", text, {.sample_interval_s = -0.4}), std::invalid_argument);
  EXPECT_THROW(read_text("a.csv", text, {.metres_per_unit = std::nan("")}), std::invalid_argument);
}

struct BadFile {
  const char* name;
  std::string text;
  const char* expected;
  const char* found;
  std::size_t line;
};

TEST(BadTrackFile, IsRejectedWithPathLineExpectedAndFound) {
  const ScratchFolder folder;
  const std::vector<BadFile> cases = {
      {"empty.csv", "", "rows", "empty", 0},
      {"blank.csv", " \n\n \t\n", "rows", "empty", 0},
      {"comments.csv", "# only\n# comments\n", "rows", "comments only", 0},
      {"binary.csv", std::string("track_id,t,x,y\n\0\1\2", 18), "text", "binary", 0},
      {"header_only.csv", "track_id,t,x,y\n", "usable row", "no row", 0},
      {"no_y.csv", "track_id,t,x\n1,2,3\n", "track_id,t,x,y", "track_id,t,x", 1},
      {"no_header.csv", "1,2,3,4\n1,3,3,4\n", "track_id,t,x,y", "1,2,3,4", 1},
      {"three.txt", "1 2 3\n4 5 6\n", "known format", "1 2 3", 1},
      {"prose.txt", "\nIt was a dark and stormy night.\n", "known format", "It was", 2},
      {"all_bad.csv", "track_id,t,x,y\n1,a,b,c\n2,a,b,c\n", "usable row",
       "rows that have a cell that is not a number: 2", 0},
      {"scene.json", "{\"origin\": [0, 0],\n \"axis_1\": [1, 0]}\n", "known format", "origin", 1},
      {"short.gz", "\x1f\x8b\x08", "gzip", "truncated", 0},
  };
  for (const BadFile& bad : cases) {
    SCOPED_TRACE(bad.name);
    const auto path = folder.write(bad.name, bad.text);
    const auto error = tests::format_error_of([&] { read_detections(path); });
    EXPECT_EQ(error.path, path.string());
    EXPECT_EQ(error.line, bad.line);
    EXPECT_TRUE(says(error.expected, bad.expected));
    EXPECT_TRUE(says(error.found, bad.found));
  }
}

TEST(BadTrackFile, IsRejectedIfTheGzipIsTruncatedAnywhere) {
  const ScratchFolder folder;
  std::string text = "track_id,t,x,y\n";
  for (int i = 0; i < 2000; ++i) text += "1," + std::to_string(i) + "," + std::to_string(i * i % 977) + ",2\n";
  const auto whole = write_gz(folder / "whole.gz", text);
  const std::string bytes = tests::content_of(whole);
  for (const std::size_t length :
       {std::size_t{2}, std::size_t{9}, std::size_t{11}, bytes.size() / 2, bytes.size() - 9, bytes.size() - 1}) {
    SCOPED_TRACE(length);
    const auto path = folder.write("cut.gz", bytes.substr(0, length));
    EXPECT_TRUE(says(tests::format_error_of([&] { read_detections(path); }).found, "truncated"));
  }
  std::string damaged = bytes;
  damaged[bytes.size() / 2] = static_cast<char>(damaged[bytes.size() / 2] ^ 0x55);
  EXPECT_THROW(read_detections(folder.write("damaged.gz", damaged)), FormatError);
}

TEST(BadTrackFile, IsRejectedIfMissingOrAFolderWithoutTracks) {
  const ScratchFolder folder;
  EXPECT_TRUE(says(tests::format_error_of([&] { read_detections(folder.path() / "no.csv"); }).found, "no such file"));
  EXPECT_TRUE(says(tests::format_error_of([&] { read_detections(folder.path()); }).found, "no .csv"));
  folder.write("a.csv", "track_id,t,x,y\n1,0,1,2\n");
  const auto error = tests::format_error_of([&] { read_detections(folder.path()); });
  EXPECT_TRUE(says(error.expected, "one track each"));
  EXPECT_TRUE(says(error.found, "a.csv"));
}

}  // namespace
}  // namespace sila
