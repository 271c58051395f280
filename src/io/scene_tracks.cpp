#include "sila/io/scene_tracks.hpp"

#include <algorithm>
#include <system_error>

#include "scene_parts.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_missing(const Scene& scene, std::size_t index) {
  std::string folders;
  for (const auto& folder : scene.searched) folders += (folders.empty() ? "" : ", ") + folder.string();
  throw FormatError(scene.path.string(), 0,
                    "files[" + std::to_string(index) + "].path = a readable file in one of " + folders,
                    "\"" + scene.files[index].path + "\", which is in none of them");
}

std::size_t common_tail(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::vector<std::filesystem::path> left(a.begin(), a.end());
  const std::vector<std::filesystem::path> right(b.begin(), b.end());
  const auto [end, unused] = std::mismatch(left.rbegin(), left.rend(), right.rbegin(), right.rend());
  return static_cast<std::size_t>(end - left.rbegin());
}

}  // namespace

const SceneFile* matching_entry(const Scene& scene, const std::filesystem::path& path) {
  const SceneFile* best = nullptr;
  std::size_t longest = 0;
  bool ambiguous = false;
  const std::filesystem::path normal = (path.has_filename() ? path : path.parent_path()).lexically_normal();
  for (const SceneFile& file : scene.files) {
    std::error_code unknown;
    if (!file.resolved.empty() && std::filesystem::equivalent(file.resolved, path, unknown)) return &file;
    const std::size_t length = common_tail(normal, std::filesystem::path(file.path).lexically_normal());
    if (length == 0 || length < longest) continue;
    ambiguous = length == longest && !(file.to_scene == best->to_scene && file.options == best->options);
    if (length > longest) best = &file;
    longest = length;
  }
  return ambiguous ? nullptr : best;
}

std::vector<SceneFile> sources_of(std::span<const std::filesystem::path> paths, const Scene& scene,
                                  const ReadOptions& options) {
  if (paths.empty() && scene.files.empty())
    throw FormatError(scene.path.empty() ? "scene" : scene.path.string(), 0, "files = a list of track files", "none");
  std::vector<SceneFile> sources;
  const ReadOptions of_scene{.camera = scene.camera};  // counts if nothing else says how positions become metres
  const auto add = [&](const std::filesystem::path& path, const SceneFile& entry) {
    sources.push_back({path.string(), path, first_of(first_of(options, entry.options), of_scene), entry.to_scene});
  };
  for (const std::filesystem::path& path : paths) {
    const SceneFile* entry = matching_entry(scene, path);
    add(path, entry == nullptr ? SceneFile{} : *entry);
  }
  for (std::size_t i = 0; paths.empty() && i < scene.files.size(); ++i) {
    if (scene.files[i].resolved.empty()) reject_missing(scene, i);
    add(scene.files[i].resolved, scene.files[i]);
  }
  return sources;
}

Detections in_scene(Detections detections, const SimilarityTransform& to_scene) {
  if (to_scene == SimilarityTransform{}) return detections;
  for (Detection& row : detections.rows) row.position_m = apply(to_scene, row.position_m);
  return detections;
}

void require_metres(bool pixels, const SceneFile& source) {
  if (!pixels || source.options.camera || source.options.metres_per_unit) return;
  throw FormatError(
      source.resolved.string(), 0, "positions in metres",
      "pixels; give --camera FILE (camera), --metres-per-unit N (metres_per_unit; 1 if they are metres) or, to "
      "learn a new model without a camera, --units pixels (units)");
}

Detections rows_of(const SceneFile& source) {
  TrackFile file = read_detections(source.resolved, source.options);
  require_metres(file.pixels, source);
  return in_scene(std::move(file.detections), source.to_scene);
}

void require_tracks(const TrackReport& report, const std::string& source) {
  if (report.tracks_kept > 0) return;
  std::string found;
  for (const std::string& line : to_lines(report)) found += (found.empty() ? "" : "; ") + line;
  throw FormatError(source, 0, "at least one track of two samples", found);
}

CleanTracks read_tracks(std::span<const std::filesystem::path> paths, const Scene& scene, const ReadOptions& options,
                        const CleanConfig& config) {
  std::vector<Detections> read;
  for (const SceneFile& source : sources_of(paths, scene, options)) read.push_back(rows_of(source));
  CleanTracks tracks = clean(read, config);
  require_tracks(tracks.report, (paths.empty() ? scene.path : paths.front()).string());
  return tracks;
}

nlohmann::json to_json(const TrackReport& report) {
  nlohmann::json dropped = nlohmann::json::object();
  for (const DroppedRows& entry : report.dropped) {
    dropped[std::string(name_of(entry.reason))] = {{"rows", entry.rows}, {"first", entry.first}};
  }
  return {{"sources", report.sources},
          {"rows_read", report.rows_read},
          {"rows_kept", report.rows_kept},
          {"dropped", dropped},
          {"track_ids", report.track_ids},
          {"tracks_kept", report.tracks_kept},
          {"out_of_order_rows", report.out_of_order_rows},
          {"splits_at_gaps", report.splits_at_gaps},
          {"splits_at_jumps", report.splits_at_jumps},
          {"standing_tracks", report.standing_tracks},
          {"warnings", report.warnings}};
}

}  // namespace sila
