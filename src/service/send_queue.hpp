#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

namespace sila::detail {

/// Lines that a connection has not read yet, up to a limit in bytes. Beyond it the oldest predictions are dropped, and
/// the next line taken says how many.
class SendQueue {
 public:
  explicit SendQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Adds a line; returns how many lines were dropped.
  std::size_t push(std::string text, bool droppable);
  /// Takes the next line; none if the queue is empty.
  std::optional<std::string> next();
  bool empty() const { return lines_.empty(); }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Line {
    std::string text;
    bool droppable = true;
  };
  std::size_t max_bytes_;
  std::deque<Line> lines_;
  std::size_t bytes_ = 0;
  std::size_t dropped_ = 0;  ///< not reported yet
};

}  // namespace sila::detail
