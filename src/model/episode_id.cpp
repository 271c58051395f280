#include <algorithm>
#include <charconv>
#include <cstdio>
#include <vector>

#include "core/bytes.hpp"
#include "model/hash.hpp"
#include "sila/model/model.hpp"

namespace sila {
namespace {

using bytes::append;

EpisodeId id_of(const std::string& content) {
  const auto [high, low] = hash_of(content);
  return {high, low};
}

EpisodeId id_of(const FramedTrajectory& framed) {
  std::string content;
  const CurbFrame& frame = framed.frame;
  for (const Vector2& part : {frame.origin_m, frame.axis_1, frame.axis_2, frame.unit_m}) {
    append(content, part.x());
    append(content, part.y());
  }
  append(content, frame.sidewalk_width_m);
  for (const double time_s : framed.track.times_s) append(content, time_s);
  for (const Vector2& position : framed.track.positions_m) {
    append(content, position.x());
    append(content, position.y());
  }
  return id_of(content);
}

}  // namespace

EpisodeId episode_id(std::span<const FramedTrajectory> batch) {
  std::vector<EpisodeId> tracks;
  for (const FramedTrajectory& track : batch) tracks.push_back(id_of(track));
  std::ranges::sort(tracks);
  std::string content;
  for (const EpisodeId& track : tracks) {
    append(content, track.high);
    append(content, track.low);
  }
  return id_of(content);
}

std::string to_text(const EpisodeId& id) {
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(id.high),
                static_cast<unsigned long long>(id.low));
  return text;
}

EpisodeId episode_id_of(const std::string& text) {
  EpisodeId id;
  const char* const end = text.data() + text.size();
  const auto read = [](const char* first, const char* last, std::uint64_t& half) {
    return std::from_chars(first, last, half, 16).ptr == last;
  };
  if (text.size() == 32 && read(text.data(), text.data() + 16, id.high) && read(text.data() + 16, end, id.low))
    return id;
  throw invalid_argument("episode_id_of: text = \"", text, "\" is no id of 32 hexadecimal digits");
}

}  // namespace sila
