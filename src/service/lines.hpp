#pragma once

#include <deque>

#include "sila/io/track_files.hpp"
#include "sila/service/rejection.hpp"

namespace sila {

/// The content of a line: detections to ingest, and the reason for each object that is none.
struct ParsedLine {
  std::vector<Detection> detections;
  std::vector<Rejection> rejections;
};

/// A line of a stream, in any form of live_detections. `has_camera`: positions are image points, so that boxes can be
/// used. Without a camera named in the options every event of Frigate is rejected.
ParsedLine parse_line(std::string_view line, const ReadOptions& options, bool has_camera);

/// The token of a line `{"token": "..."}`.
std::optional<std::string> parse_token(std::string_view line);

/// The report of rejected lines to a connection: `{"rejected": "late", "count": 12, "why": "..."}`.
std::string rejection_line(Rejection rejection, std::size_t count);

/// The report of predictions that will not come: `{"dropped": 12, "why": "..."}`.
std::string dropped_line(std::size_t count, std::string_view why);

/// Compares tokens in a time that does not depend on where they differ.
bool same_token(std::string_view a, std::string_view b);

/// Cuts the bytes that a connection reads into lines. A line over `max_bytes` comes once, cut off, so that it can be
/// rejected; the rest of it is skipped.
class LineBuffer {
 public:
  explicit LineBuffer(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void append(std::string_view bytes);
  /// The next line without its end; none until more bytes come.
  std::optional<std::string> next();
  /// The last line of the input, which may have no end; none if there is nothing left.
  std::optional<std::string> last();

 private:
  std::size_t max_bytes_;
  std::string bytes_;
  std::size_t begin_ = 0;
  bool skipping_ = false;
};

/// Lines that a connection has not read yet, up to a limit in bytes. Beyond it the oldest predictions are dropped, and
/// the next line taken says how many.
class SendQueue {
 public:
  explicit SendQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Adds a line; returns how many lines were dropped.
  std::size_t push(std::string text, bool droppable);
  /// Takes the next line; none if the queue is empty.
  std::optional<std::string> next();
  /// Takes lines with their ends until the text has `bytes` or more; empty if the queue is.
  std::string next_block(std::size_t bytes);
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

}  // namespace sila
