#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>

#include "sila/core/clean.hpp"
#include "sila/io/scene.hpp"

namespace sila {

/// The tracks of the files named, in the scene's frame; without paths, of the scene's `files`. A file that is (or is
/// named like) an entry of `files` gets that entry's `to_scene` and options; fields set in `options` win.
/// Throws: FormatError for an unreadable file, for one in pixels without a camera or a scale, if there is no file, or
/// if not one trajectory is left.
CleanTracks read_tracks(std::span<const std::filesystem::path> paths, const Scene& scene, const ReadOptions& options,
                        const CleanConfig& config);

/// The entry of the scene's `files` that a path means: the same file, else the one whose path agrees on the most
/// trailing components (at least the file name). Null if there is none, or several equally good ones with different
/// settings.
const SceneFile* matching_entry(const Scene& scene, const std::filesystem::path& path);

/// Limits of the memory in use at once. The rows of a part take some 200 bytes each.
struct StreamLimits {
  std::size_t whole_bytes = 16U << 20;  ///< a file of no more bytes is read whole
  std::size_t block_bytes = 4U << 20;   ///< bytes of a larger file in memory while it is scanned
  std::size_t rows_at_once = 400'000;   ///< rows of a larger file in memory while its tracks are read
};

/// The tracks of files, a part at a time, so that memory does not grow with their number: read_tracks for files larger
/// than memory. Tracks have the same ids and come by source, then start time, then id; the tracklets of a split track
/// come together. A large file is scanned once to find where each track is, then read in parts. Each part has whole
/// tracks, even if their rows are mixed in the file. Read whole are files whose frame numbers become seconds by an
/// interval, TrajNet++ files and folders of one-track files.
class TrackStream {
 public:
  /// As read_tracks.
  TrackStream(std::span<const std::filesystem::path> paths, const Scene& scene, const ReadOptions& options,
              const CleanConfig& config, const StreamLimits& limits = {});
  TrackStream(TrackStream&&) noexcept;
  TrackStream& operator=(TrackStream&&) noexcept;
  ~TrackStream();

  /// The next tracks, possibly an empty part; null after the last part. Throws: FormatError as read_tracks does.
  std::optional<CleanTracks> next();

  /// Whether `next` has returned the last part, as far as that is known without reading more.
  bool exhausted() const;

  /// The report on the rows so far; after the last part on all of them, as read_tracks reports it (the first row
  /// of a reason may be another one).
  const TrackReport& report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The report as JSON: the counts under their names, `dropped` as {reason: {rows, first}}, `warnings`.
nlohmann::json to_json(const TrackReport& report);

}  // namespace sila
