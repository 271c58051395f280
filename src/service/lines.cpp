#include "lines.hpp"

#include <algorithm>
#include <utility>

#include "io/json_file.hpp"

namespace sila {

ParsedLine parse_line(std::string_view line, const ReadOptions& options, bool has_camera) {
  const nlohmann::json object = shallow_json(line);
  if (!object.is_object()) return {{}, {Rejection::not_json}};
  std::optional<TrackFile> file = live_detections(object, options);
  if (!file) return {{}, {Rejection::not_a_detection}};
  ParsedLine parsed;
  for (const DroppedRows& dropped : file->detections.dropped) {
    const bool other = dropped.reason == DropReason::other_camera;
    parsed.rejections.insert(parsed.rejections.end(), dropped.rows,
                             other ? Rejection::other_camera : Rejection::not_a_detection);
  }
  for (Detection& row : file->detections.rows) {
    row.label.resize(std::min(row.label.size(), kMaxIdBytes));  // while it is queued
    if (file->pixels && !has_camera)
      parsed.rejections.push_back(Rejection::no_camera);
    else if (row.track.size() > kMaxIdBytes)
      parsed.rejections.push_back(Rejection::not_a_detection);
    else
      parsed.detections.push_back(std::move(row));
  }
  return parsed;
}

std::optional<std::string> parse_token(std::string_view line) {
  const nlohmann::json object = shallow_json(line);
  const nlohmann::json& token = member(object, "token");
  return token.is_string() ? std::optional(token.get<std::string>()) : std::nullopt;
}

std::string rejection_line(Rejection rejection, std::size_t count) {
  const RejectionText& text = text_of(rejection);
  return nlohmann::ordered_json{{"rejected", text.name}, {"count", count}, {"why", text.text}}.dump();
}

std::string dropped_line(std::size_t count, std::string_view why) {
  return nlohmann::ordered_json{{"dropped", count}, {"why", why}}.dump();
}

bool same_token(std::string_view a, std::string_view b) {
  unsigned different = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < b.size(); ++i)
    different |=
        static_cast<unsigned>(static_cast<unsigned char>(i < a.size() ? a[i] : 0) ^ static_cast<unsigned char>(b[i]));
  return different == 0;
}

void LineBuffer::append(std::string_view bytes) {
  bytes_.erase(0, std::exchange(begin_, 0));
  bytes_.append(bytes);
}

std::optional<std::string> LineBuffer::next() {
  for (std::size_t end = 0; (end = bytes_.find('\n', begin_)) != std::string::npos;) {
    const std::size_t begin = std::exchange(begin_, end + 1);
    if (!std::exchange(skipping_, false)) return bytes_.substr(begin, end - begin);
  }
  if (bytes_.size() - begin_ <= max_bytes_) return std::nullopt;
  std::string cut = bytes_.substr(begin_, max_bytes_ + 1);
  bytes_.clear();
  begin_ = 0;
  if (std::exchange(skipping_, true)) return std::nullopt;
  return cut;
}

std::optional<std::string> LineBuffer::last() {
  std::string rest = bytes_.substr(begin_);
  bytes_.clear();
  begin_ = 0;
  if (rest.empty() || std::exchange(skipping_, false)) return std::nullopt;
  return rest;
}

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

std::string SendQueue::next_block(std::size_t bytes) {
  std::string block;
  while (block.size() < bytes) {
    const std::optional<std::string> line = next();
    if (!line) break;
    block += *line + '\n';
  }
  return block;
}

}  // namespace sila
