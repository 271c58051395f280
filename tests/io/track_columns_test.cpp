// Which column of a table, or which key of JSON, means what.

#include <gtest/gtest.h>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::at_rate;
using tests::expect_row;
using tests::format_error_of;
using tests::rows_of;

Detections read(const std::string& name, const std::string& text, const ReadOptions& options = {}) {
  return tests::read_text(name, text, options).detections;
}

TEST(ColumnsWithoutAHeader, BeginWithSecondsIfTheFirstNumbersAreNotWhole) {
  expect_row(read("t.txt", "0.0 7 1 2\n0.1 7 1.5 2\n0.2 7 2 2\n").rows[1], "7", 0.1, 1.5, 2.0);
  EXPECT_EQ(read("t.txt", "0.0 7 1 2\n,,,\n0.1 7 1.5 2\n").rows.size(), 2U);
  std::string frames;  // one of many is damaged
  for (int k = 0; k < 20; ++k) frames += std::to_string(10 * k) + (k == 11 ? ".5" : "") + " 7 1 2\n";
  EXPECT_EQ(read("t.txt", frames).rows.at(1).t_s, 0.4);
  EXPECT_EQ(read("t.txt", "0.0 7 1 2\n0.1 7 1.5 2\n", {.format = TrackFormat::frame_id_x_y}).rows.at(1).t_s, 0.1);
  expect_row(read("t.txt", "780.0 7 1 2\n790.0 7 1.5 2\n").rows[0], "7", 31.2, 1.0, 2.0);
}

TEST(ColumnsWithoutAHeader, AreNotTakenByPositionIfALineOfUnknownNamesIsThere) {
  const std::string text = "f,who,a,b,c,d,e\n1,7,2,3,4,5,1\n2,7,2,3,4,5,1\n";
  const auto error = format_error_of([&] { read("t.csv", text, at_rate(10.0)); });
  EXPECT_TRUE(says(error.expected, "known names in the header line"));
  EXPECT_EQ(read("t.csv", text, {.format = TrackFormat::mot, .frames_per_second = 10.0}).rows.size(), 2U);
}

TEST(ColumnNames, OfMotChallengeAreThoseOfBoxes) {
  const std::string header = "frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z\n";
  EXPECT_EQ(read("t.csv", "frame,id,bb_left,bb_top,bb_width,bb_height,class\n5,7,0,0,4,2,1\n", at_rate(10.0))
                .rows.at(0)
                .label,
            "person");
  expect_row(read("t.csv", header + "5,7,100,50,40,120,1,-1,-1,-1\n", at_rate(10.0)).rows.at(0), "7", 0.5, 120.0,
             170.0);
  const ReadOptions forced{.format = TrackFormat::mot, .frames_per_second = 10.0};
  EXPECT_EQ(read("t.csv", header + "5,7,100,50,40,120,1,-1,-1,-1\n", forced).rows.at(0).track, "7");
  const std::string flags = "frame,id,bb_left,bb_top,bb_width,bb_height,conf,class,visibility\n";
  EXPECT_EQ(rows_of(read("t.csv", flags + "5,7,0,0,4,2,0,1,1\n5,8,0,0,4,2,1,1,1\n", at_rate(10.0)), DropReason::lost),
            1U);
  const std::string metres = "track_id,t,x,y,bbox_left,bbox_top,bbox_width,bbox_height\n7,0,1,2,700,400,40,90\n";
  expect_row(read("t.csv", metres).rows.at(0), "7", 0.0, 1.0, 2.0);
  const std::string other = "frame,class,id,left,top,width,height\n0,0,7,100,50,40,120\n0,2,8,0,0,9,9\n";
  const auto rows = read("t.csv", other, at_rate(10.0)).rows;
  expect_row(rows.at(0), "7", 0.0, 120.0, 170.0);
  EXPECT_EQ(rows.at(0).label, "person");
  EXPECT_EQ(rows.at(1).label, "2");
}

TEST(ColumnNames, OfRosSplitAStamp) {
  expect_row(read("t.csv", "secs,nsecs,id,x,y\n12,250000000,7,1,2\n").rows.at(0), "7", 12.25, 1.0, 2.0);
}

TEST(TimeStamps, OfUnixMayBeInPartsOfASecond) {
  const auto seconds_of = [](const std::string& stamp) {
    return read("t.csv", "id,timestamp,x,y\n7," + stamp + ",1,2\n").rows.at(0).t_s;
  };
  EXPECT_DOUBLE_EQ(seconds_of("1714737600.25"), 1714737600.25);
  EXPECT_DOUBLE_EQ(seconds_of("1714737600250"), 1714737600.25);
  EXPECT_DOUBLE_EQ(seconds_of("1714737600250000"), 1714737600.25);
  EXPECT_DOUBLE_EQ(seconds_of("1714737600250000000"), 1714737600.25);
  EXPECT_EQ(read("t.csv", "id,timestamp,x,y\n7,nan,1,2\n7,1.5,1,2\n").rows.back().t_s, 1.5);
  EXPECT_EQ(read("t.csv", "id,time_s,x,y\n7,1714737600250,1,2\n").rows.at(0).t_s, 1714737600250.0);
  EXPECT_DOUBLE_EQ(seconds_of("2024-05-03 14:00:00.25+02"), 1714737600.25);  // as PostgreSQL writes it
}

TEST(TrackIds, AreUtf8) {
  const auto rows = read("t.csv", "id,t,x,y\nJos\xe9,0,1,2\nJos\xc3\xa9,0,1,2\n").rows;
  EXPECT_EQ(rows.at(0).track, "Jos\xc3\xa9");
  EXPECT_EQ(rows.at(1).track, "Jos\xc3\xa9");
  EXPECT_EQ(read("t.csv", "id,t,x,y\ncam\xc3\xa9ra\\17,0,1,2\n").rows.at(0).track, "cam\xc3\xa9ra\\17");
  EXPECT_EQ(read("t.csv", "id,t,x,y,class\n7,0,1,2,pi\xe9ton\n").rows.at(0).label, "pi\xc3\xa9ton");
}

TEST(Classes, ThatAreAskedForNeedAColumn) {
  const ReadOptions options{.person_classes = {"pedestrian"}};
  const auto warnings = read("t.csv", "id,t,x,y\n7,0,1,2\n", options).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_TRUE(says(warnings[0], "no column of classes"));
  EXPECT_TRUE(read("t.csv", "id,t,x,y,class\n7,0,1,2,pedestrian\n", options).warnings.empty());
}

TEST(Classes, OfLinesMayBeNumbers) {
  const auto label_of = [](const std::string& keys) {
    return read("t.ndjson", R"({"t": 0, "id": 7, "x": 1, "y": 2, )" + keys + "}").rows.at(0).label;
  };
  EXPECT_EQ(label_of(R"("class": 0)"), "person");
  EXPECT_EQ(label_of(R"("label": null, "class": "car")"), "car");
  EXPECT_EQ(label_of(R"("label": "person", "class": "car")"), "person");
  const std::string text = R"({"t": 0, "id": 7, "x": 1, "y": 2, "class": 2})";
  EXPECT_EQ(read("t.ndjson", text).rows.at(0).label, "2");
  EXPECT_EQ(read("t.ndjson", text, {.person_classes = {"2"}}).rows.at(0).label, "person");
}

TEST(JsonArrays, MayLackTheIdOfTheirFirstObject) {
  const Detections found = read("t.json", R"([{"t": 0, "x": 1, "y": 2}, {"t": 0, "track_id": 7, "x": 1, "y": 2}])");
  EXPECT_EQ(found.rows.at(0).track, "7");
  EXPECT_EQ(rows_of(found, DropReason::missing_cells), 1U);
}

TEST(OtvisionTracks, OfItsFirstVersionHaveTheCentresOfBoxes) {
  const auto first_y = [](const std::string& version) {
    const std::string text = R"({"metadata": {"otdet_version": ")" + version + R"("}, "data": {"detections": [)" +
                             R"({"class": "person", "x": 100, "y": 50, "w": 40, "h": 120, "track-id": 1,)" +
                             R"( "occurrence": 1.5}]}})";
    return read("t.ottrk", text).rows.at(0).position_m.y();
  };
  EXPECT_DOUBLE_EQ(first_y("1.0"), 110.0);
  EXPECT_DOUBLE_EQ(first_y("1.1"), 170.0);
}

TEST(KittiTracking, DropsRowsWithoutAPlace) {
  const std::string start = "0 1 Pedestrian 0 0 -1.6 700 180 740 280 1.8 0.6 0.9 ";
  const Detections found = read("t.txt", start + "1.5 1.7 9 -1.5\n" + start + "-1000 -1000 -1000 -10\n");
  EXPECT_EQ(found.rows.size(), 1U);
  EXPECT_EQ(rows_of(found, DropReason::lost), 1U);
}

TEST(SumoFcd, PassengersAreNoPedestrians) {
  const auto rows = read("t.xml",
                         "<fcd-export><timestep time=\"1\"><person id=\"a\" x=\"1\" y=\"2\" vehicle=\"bus\"/>"
                         "<person id=\"b\" x=\"1\" y=\"2\" vehicle=\"\"/></timestep></fcd-export>")
                        .rows;
  EXPECT_EQ(rows.at(0).label, "passenger");
  EXPECT_EQ(rows.at(1).label, "person");
}

}  // namespace
}  // namespace sila
