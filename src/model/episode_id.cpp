#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "model/hash.hpp"
#include "sila/model/model.hpp"

namespace sila {
namespace {

/// Little endian on every machine.
void append(std::string& bytes, std::uint64_t word) {
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<char>((word >> (8 * i)) & 0xffU));
}

void append(std::string& bytes, double number) {
  append(bytes, std::bit_cast<std::uint64_t>(number));
}

EpisodeId id_of(const std::string& bytes) {
  const auto [high, low] = hash_of(bytes);
  return {high, low};
}

EpisodeId id_of(const FramedTrajectory& placed) {
  std::string bytes;
  const CurbFrame& frame = placed.frame;
  for (const Vector2& part : {frame.origin_m, frame.axis_1, frame.axis_2, frame.unit_m}) {
    append(bytes, part.x());
    append(bytes, part.y());
  }
  append(bytes, frame.sidewalk_width_m);
  for (const double time_s : placed.track.times_s) append(bytes, time_s);
  for (const Vector2& position : placed.track.positions_m) {
    append(bytes, position.x());
    append(bytes, position.y());
  }
  return id_of(bytes);
}

}  // namespace

EpisodeId episode_id(std::span<const FramedTrajectory> batch) {
  std::vector<EpisodeId> tracks;
  for (const FramedTrajectory& track : batch) tracks.push_back(id_of(track));
  std::ranges::sort(tracks);
  std::string bytes;
  for (const EpisodeId& track : tracks) {
    append(bytes, track.high);
    append(bytes, track.low);
  }
  return id_of(bytes);
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
  throw std::invalid_argument("episode_id_of: text = \"" + text + "\" is no id of 32 hexadecimal digits");
}

}  // namespace sila
