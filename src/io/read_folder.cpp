#include <algorithm>
#include <filesystem>
#include <iterator>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/dropped_rows.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"
#include "text_file.hpp"

// Recordings that are folders: one file for each track (VRU), or for each frame (DeepStream).
namespace sila {
namespace {

bool is_track_name(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  return name.ends_with(".csv") || name.ends_with(".txt") || name.ends_with(".csv.gz") || name.ends_with(".txt.gz");
}

std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && is_track_name(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Detections joined(Detections all, Detections part) {
  all.rows_read += part.rows_read;
  all.rows.insert(all.rows.end(), std::make_move_iterator(part.rows.begin()), std::make_move_iterator(part.rows.end()));
  add(all.dropped, part.dropped);
  return all;
}

TrackFile read_vru_folder(const std::filesystem::path& folder, std::span<const std::filesystem::path> files,
                          const ReadOptions& options) {
  TrackFile result{{folder.string(), {}}, TrackFormat::vru, "time stamps of each track's file"};
  result.detections.own_clocks = true;
  std::vector<std::string> skipped;
  std::size_t tracks = 0;
  for (const auto& path : files) {
    try {
      const std::string id = path.lexically_relative(folder).generic_string();
      ReadOptions same = options;
      same.format = TrackFormat::vru;
      result.detections =
          joined(std::move(result.detections), tracks_of_text(path.string(), read_text(path), same, id).detections);
      ++tracks;
    } catch (const FormatError& error) {
      skipped.emplace_back(error.what());
    }
  }
  if (tracks == 0) {
    const std::string found = skipped.empty() ? "no .csv or .txt file" : "none (" + skipped.front() + ")";
    throw FormatError(folder.string(), 0, "a folder of files that are one track each (header timestamp,x,y)", found);
  }
  if (!skipped.empty()) {
    result.detections.warnings.push_back(folder.string() + ": " + std::to_string(skipped.size()) + " of " +
                                         std::to_string(skipped.size() + tracks) +
                                         " files skipped, the first: " + skipped.front());
  }
  return result;
}

/// A file of DeepStream's `kitti-track-output-dir`, by its name: program, stream, frame.
std::smatch deepstream_name(const std::string& name) {
  static const std::regex parts(R"((\d+)_(\d{3})_(\d{6,})\.txt)");
  std::smatch match;
  std::regex_match(name, match, parts);
  return match;
}

bool is_deepstream(std::span<const std::filesystem::path> files) {
  return !files.empty() && std::ranges::all_of(files, [](const std::filesystem::path& path) {
    const std::string name = path.filename().string();
    return !deepstream_name(name).empty();
  });
}

/// Lines `type id truncated ...` of a frame as those of KITTI, which begin with `frame id type`.
std::string kitti_lines(const std::string& frame, std::string_view text) {
  std::string lines;
  for (const TextLine& line : lines_of(text)) {
    std::vector<std::string_view> cells = cells_of(line.text, ' ');
    if (cells.size() > 1) std::swap(cells[0], cells[1]);
    lines += frame;
    for (const std::string_view cell : cells) lines += " " + std::string(cell);
    lines += "\n";
  }
  return lines;
}

TrackFile read_deepstream_folder(const std::filesystem::path& folder, std::span<const std::filesystem::path> files,
                                 const ReadOptions& options) {
  if (!options.frames_per_second && !options.sample_interval_s)
    throw FormatError(folder.string(), 0, "a frame rate (frames_per_second, --fps)",
                      "files of DeepStream, one a frame");
  std::set<std::string> streams;
  std::string text;
  for (const auto& path : files) {
    const std::string name = path.filename().string();
    const std::smatch parts = deepstream_name(name);
    streams.insert(parts[2]);
    if (std::filesystem::file_size(path) > 0) text += kitti_lines(parts[3], read_text(path));  // empty: nobody in view
  }
  if (streams.size() > 1)
    throw FormatError(folder.string(), 0, "files of one stream (the second number in their names)",
                      std::to_string(streams.size()) + " streams; move each to a folder of its own");
  ReadOptions kitti = options;
  kitti.format = TrackFormat::kitti;
  return tracks_of_text(folder.string(), text, kitti, "");
}

}  // namespace

TrackFile read_folder(const std::filesystem::path& folder, const ReadOptions& options) {
  const std::vector<std::filesystem::path> files = files_below(folder);
  const bool deepstream = is_deepstream(files);
  const TrackFormat format = deepstream ? TrackFormat::kitti : TrackFormat::vru;
  if (options.format.value_or(format) != format)
    throw FormatError(folder.string(), 0, "a file of format " + std::string(name_of(*options.format)), "a folder");
  return deepstream ? read_deepstream_folder(folder, files, options) : read_vru_folder(folder, files, options);
}

}  // namespace sila
