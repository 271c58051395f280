#pragma once

#include <tbb/global_control.h>

#include <optional>

namespace sila {

/// Limits the threads of everything that runs while it exists; 0 means no limit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads) {
    if (threads > 0) control_.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }

 private:
  std::optional<tbb::global_control> control_;
};

}  // namespace sila
