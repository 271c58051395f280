#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

namespace sila::detail {

/// Lines that wait until a connection reads them, at most so many bytes: what is too much is dropped, the oldest
/// predictions first, and the next lines taken begin with how many were.
struct Outbox {
  struct Waiting {
    std::string text;
    bool droppable = true;
  };
  std::deque<Waiting> lines;
  std::size_t bytes = 0;
  std::size_t dropped = 0;  ///< and not told yet
};

/// Returns how many lines were dropped for it.
std::size_t push(Outbox& box, std::string text, bool droppable, std::size_t most_bytes);

/// The next lines, about so many bytes of them (at least one line, if there is one).
std::vector<std::string> take(Outbox& box, std::size_t about_bytes);

}  // namespace sila::detail
