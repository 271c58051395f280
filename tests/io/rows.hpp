#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sila/core/detections.hpp"

namespace sila::tests {

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

}  // namespace sila::tests
