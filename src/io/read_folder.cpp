#include <algorithm>
#include <iterator>
#include <regex>

#include "core/dropped_rows.hpp"
#include "read_rows.hpp"
#include "sila/core/errors.hpp"

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
  TrackFile result{{folder.string(), {}}, TrackFormat::vru};
  result.detections.own_clocks = true;
  std::vector<std::string> skipped;
  for (const auto& path : files) {
    try {
      const std::string id = path.lexically_relative(folder).generic_string();
      ReadOptions same = options;
      same.format = TrackFormat::vru;
      result.detections =
          joined(std::move(result.detections), tracks_of_text(path.string(), read_text(path), same, id).detections);
    } catch (const FormatError& error) {
      skipped.emplace_back(error.what());
    }
  }
  if (skipped.size() == files.size()) {
    const std::string found = skipped.empty() ? "no .csv or .txt file" : "none (" + skipped.front() + ")";
    throw FormatError(folder.string(), 0,
                      "a folder of files that are one track each (header timestamp,x,y) or one frame each (DeepStream)",
                      found);
  }
  if (!skipped.empty()) {
    result.detections.warnings.push_back(folder.string() + ": " + std::to_string(skipped.size()) + " of " +
                                         std::to_string(files.size()) +
                                         " files skipped, the first: " + skipped.front());
  }
  return result;
}

/// A file of DeepStream's `kitti-track-output-dir`: lines of one frame.
struct FrameFile {
  std::filesystem::path path;
  std::string stream;  ///< folder, program and number of the stream
  std::string frame;
};

std::vector<FrameFile> deepstream_files(std::span<const std::filesystem::path> files) {
  static const std::regex parts(R"((\d+_\d{3})_(\d{6,})\.txt(?:\.gz)?)");
  std::vector<FrameFile> found;
  for (const std::filesystem::path& path : files) {
    const std::string name = path.filename().string();
    std::smatch match;
    if (std::regex_match(name, match, parts))
      found.push_back({path, (path.parent_path() / match[1].str()).string(), match[2]});
  }
  return found;
}

/// Lines `type id truncated ...` of a frame as those of KITTI, which begin with `frame id type`.
std::string kitti_lines(const std::string& frame, std::string_view text) {
  std::string lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::vector<std::string_view> cells = cells_of(text.substr(begin, end - begin), ' ');
    if (cells.size() > 1) {
      std::swap(cells[0], cells[1]);
      lines += frame;
      for (const std::string_view cell : cells) lines += " " + std::string(cell);
    }
    lines += "\n";
    begin = end + 1;
  }
  return lines;
}

TrackFile read_deepstream_folder(const std::filesystem::path& folder, std::span<const FrameFile> files,
                                 const ReadOptions& options) {
  if (!options.frames_per_second)
    throw FormatError(folder.string(), 0, "a frame rate (frames_per_second, --fps)",
                      "files of DeepStream, one a frame");
  TrackFile result{{folder.string(), {}}, TrackFormat::kitti};
  ReadOptions kitti = options;
  kitti.format = TrackFormat::kitti;
  for (const FrameFile& file : files) {
    if (file.stream != files.front().stream)
      throw FormatError(folder.string(), 0, "the files of one stream",
                        files.front().stream + " and " + file.stream +
                            "; give the folder of each stream, and a model to each camera");
    if (std::filesystem::file_size(file.path) == 0) continue;  // a frame without boxes
    const std::string lines = kitti_lines(file.frame, read_text(file.path));
    const TextTable table = table_of(file.path.string(), lines);
    TrackFile part = read_table(table, *table_reader(table, kitti), "");
    result.pixels = part.pixels;
    result.detections = joined(std::move(result.detections), std::move(part.detections));
  }
  if (result.detections.rows.empty())
    throw FormatError(folder.string(), 0, "boxes in the files of DeepStream", "none that can be used");
  return result;
}

}  // namespace

TrackFile read_folder(const std::filesystem::path& folder, const ReadOptions& options) {
  const std::vector<std::filesystem::path> files = files_below(folder);
  const std::vector<FrameFile> frames = deepstream_files(files);
  const TrackFormat format = frames.empty() ? TrackFormat::vru : TrackFormat::kitti;
  if (options.format.value_or(format) != format)
    throw FormatError(folder.string(), 0, "a file of format " + std::string(name_of(*options.format)), "a folder");
  return frames.empty() ? read_vru_folder(folder, files, options) : read_deepstream_folder(folder, frames, options);
}

}  // namespace sila
