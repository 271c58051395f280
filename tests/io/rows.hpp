#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "io/files.hpp"
#include "sila/core/detections.hpp"
#include "sila/io/track_files.hpp"

namespace sila::tests {

/// What is read of a file with this name and content.
inline TrackFile read_text(const std::string& name, const std::string& text, const ReadOptions& options = {}) {
  return read_detections(ScratchFolder().write(name, text), options);
}

/// What a row of every format should become.
inline void expect_row(const Detection& row, const std::string& track, double t_s, double x_m, double y_m) {
  EXPECT_EQ(row.track, track);
  EXPECT_DOUBLE_EQ(row.t_s, t_s);
  EXPECT_DOUBLE_EQ(row.position_m.x(), x_m);
  EXPECT_DOUBLE_EQ(row.position_m.y(), y_m);
}

inline std::size_t rows_of(const Detections& detections, DropReason reason) {
  const auto found = std::find_if(detections.dropped.begin(), detections.dropped.end(),
                                  [&](const DroppedRows& entry) { return entry.reason == reason; });
  return found == detections.dropped.end() ? 0 : found->rows;
}

/// The file of a camera above a field of 10 m times 20 m.
inline constexpr const char* kCamera =
    R"({"image_points": [[0, 1000], [1000, 1000], [400, 500], [600, 500]], "ground_points": [[0, 0], [10, 0], [0, 20], [10, 20]]})";

inline ReadOptions at_rate(double frames_per_second) {
  return {.frames_per_second = frames_per_second};
}

}  // namespace sila::tests
