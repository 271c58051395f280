#pragma once

#include <string>
#include <vector>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// One row of tracker output, before anything was judged: it may be out of order, repeated or not finite.
struct Detection {
  std::string track;  ///< id as in the input; unique only inside one file
  double t_s = 0.0;
  Vector2 position_m = Vector2::Zero();
};

/// The rows of one file (or one folder that makes one recording), in the order of the file.
struct Detections {
  std::string source;  ///< path, for messages
  std::vector<Detection> rows;
};

}  // namespace sila
