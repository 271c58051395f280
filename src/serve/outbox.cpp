#include "outbox.hpp"

#include <algorithm>

#include "sila/serve/lines.hpp"

namespace sila::detail {

std::size_t push(Outbox& box, std::string text, bool droppable, std::size_t most_bytes) {
  box.bytes += text.size();
  box.lines.push_back({std::move(text), droppable});
  std::size_t dropped = 0;
  while (box.bytes > most_bytes && box.lines.size() > 1) {
    auto oldest = std::find_if(box.lines.begin(), box.lines.end(), [](const auto& line) { return line.droppable; });
    if (oldest == box.lines.end()) oldest = box.lines.begin();
    box.bytes -= oldest->text.size();
    box.lines.erase(oldest);
    ++dropped;
  }
  box.dropped += dropped;
  return dropped;
}

std::vector<std::string> take(Outbox& box, std::size_t about_bytes) {
  std::vector<std::string> taken;
  std::size_t bytes = 0;
  if (box.dropped > 0) {
    taken.push_back(dropped_line(box.dropped, "the connection reads too slowly"));
    box.dropped = 0;
  }
  while (!box.lines.empty() && bytes < about_bytes) {
    bytes += box.lines.front().text.size();
    taken.push_back(std::move(box.lines.front().text));
    box.lines.pop_front();
  }
  box.bytes -= bytes;
  return taken;
}

}  // namespace sila::detail
