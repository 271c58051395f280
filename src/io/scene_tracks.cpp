#include "sila/io/scene_tracks.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/concatenate.hpp"
#include "core/dropped_rows.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_missing(const Scene& scene, std::size_t index) {
  throw FormatError(scene.path.string(), 0,
                    concatenate("files[", index, "].path = a readable file in one of ",
                                joined(scene.searched, ", ", [](const auto& folder) { return folder.string(); })),
                    "\"" + scene.files[index].path + "\", which is in none of them");
}

std::size_t common_tail(const std::filesystem::path& a, const std::filesystem::path& b) {
  const std::vector<std::filesystem::path> left(a.begin(), a.end());
  const std::vector<std::filesystem::path> right(b.begin(), b.end());
  const auto [end, unused] = std::mismatch(left.rbegin(), left.rend(), right.rbegin(), right.rend());
  return static_cast<std::size_t>(end - left.rbegin());
}

/// The files named; without paths, those of the scene. One that is (or is named like) an entry of the scene's `files`
/// gets its settings; fields set in `options` win. All are `resolved`. Throws: FormatError if there is none, or one of
/// the scene is in none of the folders searched.
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

/// The rows of the source in the frame of the scene.
Detections in_scene(Detections detections, const SimilarityTransform& to_scene) {
  if (to_scene == SimilarityTransform{}) return detections;
  for (Detection& row : detections.rows) row.position_m = apply(to_scene, row.position_m);
  return detections;
}

/// Throws: FormatError for a file in pixels without a camera or a scale.
void require_metres(bool pixels, const SceneFile& source) {
  if (!pixels || source.options.camera || source.options.metres_per_unit) return;
  throw FormatError(
      source.resolved.string(), 0, "positions in metres",
      "pixels; give --camera FILE (camera), --metres-per-unit N (metres_per_unit; 1 if they are metres) or, to "
      "learn a new model without a camera, --units pixels (units)");
}

/// All rows of the source in the frame of the scene. Throws: as read_detections and require_metres.
Detections rows_of(const SceneFile& source) {
  TrackFile file = read_detections(source.resolved, source.options);
  require_metres(file.pixels, source);
  return in_scene(std::move(file.detections), source.to_scene);
}

/// Throws: FormatError with the counts of dropped rows, if they made no track.
void require_tracks(const TrackReport& report, const std::string& source) {
  if (report.tracks_kept > 0) return;
  throw FormatError(source, 0, "at least one track of two samples", joined(to_lines(report), "; "));
}

/// Whole lines of a text file that follow each other.
struct TextBlock {
  std::string text;
  std::size_t first_line = 1;  ///< 1-based
};

/// A text file, gzipped or not, in blocks of whole lines, so that a file of any size is read with the memory of one
/// block. Blocks may be read again, in any order.
class TextBlocks {
 public:
  /// Throws: FormatError for a file that is missing, a folder or unreadable.
  TextBlocks(const std::filesystem::path& path, std::size_t block_bytes)
      : path_(path.string()), file_(path_), block_bytes_(block_bytes) {}

  /// Block `index`; null behind the last one. A block is known once all before it were read.
  /// Throws: FormatError for truncated bytes, bytes that are no text, or a line that is longer than a block.
  std::optional<TextBlock> read(std::size_t index) {
    if (index >= places_.size()) throw std::logic_error("TextBlocks: a block was left out");
    const BlockStart place = places_[index];
    file_.seek(place.offset);
    TextBlock block{std::string(block_bytes_, '\0'), place.line};
    block.text.resize(file_.read(block.text));
    if (block.text.empty()) return std::nullopt;
    if (block.text.size() == block_bytes_) {
      const std::size_t end = block.text.rfind('\n');
      if (end == std::string::npos) {
        throw FormatError(path_, place.line, "lines of less than " + std::to_string(block_bytes_) + " bytes",
                          "a longer one");
      }
      block.text.resize(end + 1);
    }
    reject_binary(path_, block.text);
    if (index + 1 == places_.size()) {
      const auto lines = static_cast<std::size_t>(std::ranges::count(block.text, '\n'));
      places_.push_back({place.offset + block.text.size(), place.line + lines});
    }
    if (place.offset == 0 && block.text.starts_with(kByteOrderMark)) block.text.erase(0, kByteOrderMark.size());
    return block;
  }

 private:
  struct BlockStart {
    std::size_t offset = 0;
    std::size_t line = 1;
  };

  std::string path_;
  GzipFile file_;
  std::size_t block_bytes_;
  std::vector<BlockStart> places_{BlockStart{}};  ///< where each block begins, and where the next unread one does
};

/// Where the rows of a track are.
struct TrackPlace {
  std::string id;
  double start_s = std::numeric_limits<double>::infinity();
  std::size_t rows = 0;
  std::size_t first_block = 0;
  std::size_t last_block = 0;
};

/// One file: a first pass finds its tracks, then it is read in parts of whole tracks.
class LargeFile {
 public:
  LargeFile(const SceneFile& source, TableReader reader, const StreamLimits& limits)
      : name_(source.resolved.string()),
        to_scene_(source.to_scene),
        limits_(limits),
        reader_(std::move(reader)),
        blocks_(source.resolved, limits.block_bytes) {
    headless_ = reader_;
    headless_.columns.header = false;
    find_tracks();
  }

  bool finished() const { return next_track_ == tracks_.size() && reported_; }

  /// The rows of the next tracks; nothing after the last. What the reader dropped is reported with the first.
  std::optional<Detections> next() {
    if (finished()) return std::nullopt;
    Detections part = reported_ ? Detections{name_, {}} : std::move(dropped_);
    reported_ = true;
    std::size_t end = next_track_;
    std::size_t rows = 0;
    std::unordered_set<std::string_view> wanted;
    std::vector<char> needed(block_count_, 0);
    for (; end < tracks_.size() && (rows == 0 || rows + tracks_[end].rows <= limits_.rows_at_once); ++end) {
      const TrackPlace& track = tracks_[end];
      rows += track.rows;
      wanted.insert(track.id);
      std::fill(needed.begin() + static_cast<std::ptrdiff_t>(track.first_block),
                needed.begin() + static_cast<std::ptrdiff_t>(track.last_block) + 1, 1);
    }
    part.rows.reserve(rows);
    for (std::size_t i = 0; i < needed.size(); ++i) {
      if (needed[i] == 0) continue;
      Detections block = rows_of_block(i).value_or(Detections{});  // none if the file was cut since
      for (Detection& row : block.rows) {
        if (wanted.contains(row.track)) part.rows.push_back(std::move(row));
      }
    }
    part.rows_read += part.rows.size();
    next_track_ = end;
    return in_scene(std::move(part), to_scene_);
  }

 private:
  /// Null behind the last block.
  std::optional<Detections> rows_of_block(std::size_t index) {
    const auto block = blocks_.read(index);
    if (!block) return std::nullopt;
    if (trimmed(block->text).empty()) return Detections{name_, {}};
    const TextTable table = table_of(name_, block->text, block->first_line);
    return read_table(table, index == 0 ? reader_ : headless_, {}).detections;
  }

  void find_tracks() {
    std::unordered_map<std::string, std::size_t> index;
    dropped_.source = name_;
    for (; const auto block = rows_of_block(block_count_); ++block_count_) {
      if (block_count_ == 0) dropped_.warnings = block->warnings;
      add(dropped_.dropped, block->dropped);
      for (const DroppedRows& entry : block->dropped) dropped_.rows_read += entry.rows;
      for (const Detection& row : block->rows) {
        const auto [entry, is_new] = index.try_emplace(row.track, tracks_.size());
        if (is_new) tracks_.push_back({.id = row.track, .first_block = block_count_});
        TrackPlace& track = tracks_[entry->second];
        ++track.rows;
        track.last_block = block_count_;
        if (row.t_s < track.start_s) track.start_s = row.t_s;
      }
    }
    std::ranges::sort(tracks_, [](const TrackPlace& a, const TrackPlace& b) {
      return a.start_s != b.start_s ? a.start_s < b.start_s : id_less(a.id, b.id);
    });
  }

  std::string name_;
  SimilarityTransform to_scene_;
  StreamLimits limits_;
  TableReader reader_, headless_;
  TextBlocks blocks_;
  std::size_t block_count_ = 0;
  std::vector<TrackPlace> tracks_;
  std::size_t next_track_ = 0;
  bool reported_ = false;
  Detections dropped_;
};

/// How to read a file in parts; none if it must be read whole. Throws: FormatError if it is no track file.
std::optional<TableReader> reader_in_parts(const SceneFile& source, const StreamLimits& limits) {
  std::error_code unknown;
  if (std::filesystem::is_directory(source.resolved, unknown)) return std::nullopt;
  validate(source.options);
  std::string start(4096, '\0');  // formats that are read whole may have one line longer than a block
  start.resize(GzipFile(source.resolved.string()).read(start));
  if (start.starts_with(kByteOrderMark)) start.erase(0, kByteOrderMark.size());
  if (source.options.format == TrackFormat::sumo_fcd || is_xml(start) || is_json_array(start) ||
      json_boxes_format(start, source.options.format))
    return std::nullopt;
  const std::optional<TextBlock> head = TextBlocks(source.resolved, limits.block_bytes).read(0);
  const std::string text = text_of_bytes(source.resolved.string(), head ? head->text : "");  // rejects an empty file
  auto reader = table_reader(table_of(source.resolved.string(), text), source.options);
  if (reader) require_metres(reader->columns.pixels, source);
  const bool is_large = std::filesystem::file_size(source.resolved, unknown) > limits.whole_bytes && !unknown;
  if (!reader || !is_large || !reader->columns.id) return std::nullopt;
  // With an interval the seconds of a row depend on the other rows.
  return reader->columns.time || reader->options.frames_per_second ? reader : std::nullopt;
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

struct TrackStream::State {
  std::string name;
  std::vector<SceneFile> sources;
  std::vector<std::optional<TableReader>> readers;
  std::vector<std::string> prefixes;
  CleanConfig config;
  StreamLimits limits;
  std::size_t source = 0;
  std::size_t first_recording = 0, next_recording = 1;  ///< of this source, of the next one
  std::optional<LargeFile> large;
  TrackReport report;

  void begin_next_source() {
    ++source;
    first_recording = std::exchange(next_recording, next_recording + 1);
  }

  CleanTracks cleaned(const Detections& rows, bool begins) {
    CleanTracks tracks = clean(std::span(&rows, 1), config, {prefixes[source]});
    for (Trajectory& track : tracks.trajectories) {
      track.recording += first_recording;
      next_recording = std::max(next_recording, track.recording + 1);
    }
    if (!begins) {  // units are checked on the first part alone
      tracks.report.sources = 0;
      tracks.report.warnings.clear();
    }
    add(report, tracks.report);
    return tracks;
  }
};

TrackStream::TrackStream(std::span<const std::filesystem::path> paths, const Scene& scene, const ReadOptions& options,
                         const CleanConfig& config, const StreamLimits& limits)
    : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.sources = sources_of(paths, scene, options);
  state.name = paths.empty() ? scene.path.string() : paths.front().string();
  std::vector<std::string> names;
  for (const SceneFile& source : state.sources) {
    names.push_back(source.resolved.string());
    state.readers.push_back(reader_in_parts(source, limits));
  }
  state.prefixes = id_prefixes(names);
  state.config = config;
  state.limits = limits;
}

TrackStream::TrackStream(TrackStream&&) noexcept = default;
TrackStream& TrackStream::operator=(TrackStream&&) noexcept = default;
TrackStream::~TrackStream() = default;

std::optional<CleanTracks> TrackStream::next() {
  State& state = *state_;
  for (; state.source < state.sources.size(); state.begin_next_source()) {
    const SceneFile& source = state.sources[state.source];
    auto& reader = state.readers[state.source];
    if (!reader && !state.large) {
      CleanTracks tracks = state.cleaned(rows_of(source), true);
      state.begin_next_source();
      return tracks;
    }
    const bool begins = !state.large;
    if (begins) state.large.emplace(source, *std::exchange(reader, std::nullopt), state.limits);
    if (const auto rows = state.large->next()) return state.cleaned(*rows, begins);
    state.large.reset();
  }
  require_tracks(state.report, state.name);
  return std::nullopt;
}

bool TrackStream::exhausted() const {
  const State& state = *state_;
  const std::size_t left = state.sources.size() - state.source;
  return left == 0 || (left == 1 && state.large && state.large->finished());
}

const TrackReport& TrackStream::report() const {
  return state_->report;
}

}  // namespace sila
