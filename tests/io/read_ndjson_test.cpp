#include <gtest/gtest.h>

#include "io/files.hpp"
#include "io/rows.hpp"
#include "sila/io/track_files.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using tests::expect_row;
using tests::read_text;
using tests::rows_of;

TEST(TrajNetPlusPlus, ReadsTracksAndTheRateOfTheScenes) {
  const auto file =
      read_text("a.ndjson",
                "{\"scene\": {\"id\": 0, \"p\": 3, \"s\": 0, \"e\": 20, \"fps\": 2.5, \"tag\": [1, []]}}\n"
                "{\"track\": {\"f\": 0, \"p\": 3, \"x\": 1.5, \"y\": 2}}\n{\"track\": {\"f\": 10, \"p\": 3, \"x\": "
                "2, \"y\": 2.5}}\n"
                "{\"track\": {\"f\": 20, \"p\": 3, \"x\": \"far\", \"y\": 2.5}}\n{\"track\": {\"f\": 30, \"p\"\n");
  EXPECT_EQ(file.format, TrackFormat::trajnetpp);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[1], "3", 0.4, 2.0, 2.5);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
  EXPECT_EQ(file.detections.rows_read, 4U);
}

TEST(DetectionLines, AreReadAsTheServiceHearsThem) {
  const std::string text =
      "{\"t\": 0.1, \"id\": \"a\", \"x\": 1.5, \"y\": 2}\n{\"t\": 0.2, \"id\": 7, \"x\": 2, \"y\": 2.5, \"label\": "
      "\"cyclist\"}\n{\"t\": 0.3, \"id\": \"a\", \"x\": \"far\", \"y\": 2}\n{\"t\": 0.4, \"id\n";
  const auto file = read_text("a.ndjson", text);
  EXPECT_EQ(file.format, TrackFormat::ndjson);
  ASSERT_EQ(file.detections.rows.size(), 2U);
  expect_row(file.detections.rows[0], "a", 0.1, 1.5, 2.0);
  expect_row(file.detections.rows[1], "7", 0.2, 2.0, 2.5);
  EXPECT_EQ(file.detections.rows[1].label, "cyclist");
  EXPECT_EQ(rows_of(file.detections, DropReason::not_a_number), 1U);
  EXPECT_EQ(rows_of(file.detections, DropReason::not_json), 1U);
  EXPECT_EQ(file.detections.rows_read, 4U);
}

TEST(DetectionLines, AreNotPredictions) {
  const std::string text = "{\"track\": \"1\", \"t0\": 3.2, \"t\": [0.2], \"modes\": [{\"x\": [1], \"y\": [2]}]}\n";
  const std::string message = message_of<FormatError>([&] { read_text("p.ndjson", text); });
  EXPECT_TRUE(says(message, "p.ndjson:1: expected tracks, found predictions of sila; give the tracks")) << message;
}

}  // namespace
}  // namespace sila
