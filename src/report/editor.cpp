#include <fstream>
#include <iterator>

#include "encode.hpp"
#include "io/json_file.hpp"
#include "report/model_data.hpp"
#include "sila/core/errors.hpp"
#include "sila/report/report.hpp"
#include "sila/version.hpp"

namespace sila {
namespace {

using nlohmann::ordered_json;

/// The file with the corners as they were read, so that the page finds each in one form.
nlohmann::json file_json(const EditorInput& input) {
  nlohmann::json file = input.file.is_object() ? input.file : nlohmann::json::object();
  if (input.scene.corners.empty()) {
    file.update({{"name", input.scene.name},
                 {"y_axis", input.scene.y_axis == YAxis::up ? "up" : "down"},
                 {"corners", nlohmann::json::array()}});
    return file;
  }
  nlohmann::json corners = nlohmann::json::parse(to_text(input.scene));
  if (input.picture.empty() || input.in_picture) corners.erase("files");
  corners.erase("camera");
  file.update(corners);
  return file;
}

std::vector<FramedTrajectory> in_image(std::vector<FramedTrajectory> tracks, const Camera& camera) {
  for (FramedTrajectory& entry : tracks) {
    for (Vector2& position : entry.track.positions_m) position = to_image(camera, position).value_or(Vector2::Zero());
  }
  return tracks;
}

}  // namespace

ordered_json editor_data(const EditorInput& input, std::size_t most_bytes) {
  if (input.tracks.empty()) throw std::invalid_argument("editor_data: tracks = [], at least one is needed");
  ordered_json data{{"sila", build_version()},
                    {"file", file_json(input)},
                    {"file_name", input.file_name},
                    {"proposal", input.proposal},
                    {"tracks_in", input.in_picture ? "picture" : "ground"}};
  const std::optional<Camera>& camera = input.scene.camera;
  if (camera) data["camera"] = camera_json(*camera);
  const std::vector<FramedTrajectory> tracks =
      input.in_picture && camera ? in_image(input.tracks, *camera) : input.tracks;
  for (std::size_t most = 300;; most /= 2) {
    data["tracks"] = tracks_json(tracks, most);
    if (most <= 1 || one_line(data).size() <= most_bytes) break;
  }
  if (!input.picture.empty()) data["picture"] = input.picture;
  return data;
}

std::string picture_url(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.empty()) throw FormatError(path.string(), 0, "a PNG or JPEG picture", "no file that can be read");
  const bool png = bytes.starts_with("\x89PNG\r\n\x1a\n");
  if (!png && !bytes.starts_with("\xff\xd8\xff"))
    throw FormatError(path.string(), 0, "a PNG or JPEG picture", "a file of another kind");
  return (png ? "data:image/png;base64," : "data:image/jpeg;base64,") + detail::base64(bytes);
}

}  // namespace sila
