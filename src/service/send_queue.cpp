#include "send_queue.hpp"

#include <algorithm>
#include <utility>

#include "lines.hpp"

namespace sila::detail {

std::size_t SendQueue::push(std::string text, bool droppable) {
  bytes_ += text.size();
  lines_.push_back({std::move(text), droppable});
  std::size_t dropped = 0;
  for (; bytes_ > max_bytes_ && lines_.size() > 1; ++dropped) {
    auto oldest = std::find_if(lines_.begin(), lines_.end(), [](const Line& line) { return line.droppable; });
    if (oldest == lines_.end()) oldest = lines_.begin();
    bytes_ -= oldest->text.size();
    lines_.erase(oldest);
  }
  dropped_ += dropped;
  return dropped;
}

std::optional<std::string> SendQueue::next() {
  if (dropped_ > 0) return dropped_line(std::exchange(dropped_, 0), "the connection reads too slowly");
  if (lines_.empty()) return std::nullopt;
  std::string text = std::move(lines_.front().text);
  lines_.pop_front();
  bytes_ -= text.size();
  return text;
}

}  // namespace sila::detail
