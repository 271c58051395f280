#include <string>

#include "sila/io/files.hpp"
#include "sila/io/track_files.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

/// An id that holds a comma or blank at its ends needs quotes.
std::string quoted_if_needed(const std::string& id) {
  return id.find_first_of(", \t") == std::string::npos ? id : '"' + id + '"';
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
