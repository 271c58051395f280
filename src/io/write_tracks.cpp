#include <stdexcept>

#include "sila/io/files.hpp"
#include "sila/io/track_files.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

/// Without quotes a comma separates, blanks at the ends are cut, `#` begins a comment and `'` may be a quote. Throws:
/// std::invalid_argument for an id that the reader cannot read back, as no character is escaped.
std::string quoted_if_needed(const std::string& id) {
  if (id.empty() || id.find_first_of(std::string_view("\"\n\0", 3)) != std::string::npos)
    throw std::invalid_argument("write_tracks_csv: id = " + excerpt(id) +
                                " is empty or has a quote, a line end or a zero byte, which CSV cannot hold");
  const bool plain = id.find_first_of(", \t\r\v\f") == std::string::npos && id.front() != '#' && id.front() != '\'';
  return plain ? id : '"' + id + '"';
}

}  // namespace

void write_tracks_csv(const std::filesystem::path& path, std::span<const Trajectory> tracks) {
  std::string text = "track_id,t,x,y\n";
  for (const Trajectory& track : tracks) {
    validate(track);
    const std::string id = quoted_if_needed(track.id);
    for (std::size_t i = 0; i < track.times_s.size(); ++i) {
      const Vector2& position = track.positions_m[i];
      text += id + ',' + exact(track.times_s[i]) + ',' + exact(position.x()) + ',' + exact(position.y()) + '\n';
    }
  }
  write_file(path, text);
}

}  // namespace sila
