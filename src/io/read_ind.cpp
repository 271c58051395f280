#include <algorithm>
#include <filesystem>

#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

/// The path of the meta file that belongs to XX_tracks.csv, gzipped or not; nothing if it is not there.
std::optional<std::string> beside(const std::string& tracks_path, const std::string& suffix) {
  const std::size_t at = tracks_path.rfind("_tracks.csv");
  if (at == std::string::npos) return std::nullopt;
  for (const char* end : {"", ".gz"}) {
    const std::string path = tracks_path.substr(0, at) + suffix + end;
    if (std::filesystem::exists(path)) return path;
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> two_columns(const std::string& path, const std::string& text,
                                                             const char* first, const char* second) {
  const TextTable table = table_of(path, text);
  const auto names = cells_of(table.rows.front().text, ',');
  const auto index = [&](const char* name) {
    const auto found =
        std::find_if(names.begin(), names.end(), [&](std::string_view cell) { return lower(cell) == name; });
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    throw FormatError(path, table.rows.front().number, std::string("a column ") + name,
                      excerpt(table.rows.front().text));
  };
  const std::size_t a = index(first);
  const std::size_t b = index(second);
  std::vector<std::pair<std::string, std::string>> rows;
  for (std::size_t i = 1; i < table.rows.size(); ++i) {
    const auto cells = cells_of(table.rows[i].text, ',');
    if (cells.size() <= std::max(a, b))
      throw FormatError(path, table.rows[i].number, "as many cells as names", excerpt(table.rows[i].text));
    rows.emplace_back(cells[a], cells[b]);
  }
  return rows;
}

std::map<std::string, std::string> read_ind_classes(const std::string& tracks_path) {
  const auto path = beside(tracks_path, "_tracksMeta.csv");
  if (!path) {
    throw FormatError(tracks_path, 0, "a file NN_tracks.csv with NN_tracksMeta.csv beside it (it has the classes)",
                      "none");
  }
  std::map<std::string, std::string> classes;
  for (auto& [id, label] : two_columns(*path, read_text(*path), "trackid", "class"))
    classes.insert_or_assign(std::move(id), std::move(label));
  return classes;
}

std::optional<double> read_ind_frame_rate(const std::string& tracks_path) {
  const auto path = beside(tracks_path, "_recordingMeta.csv");
  if (!path) return std::nullopt;
  const auto rows = two_columns(*path, read_text(*path), "recordingid", "framerate");
  const auto rate = rows.empty() ? std::nullopt : number_of(rows.front().second);
  if (!rate || !(*rate > 0.0))
    throw FormatError(*path, 2, "frameRate > 0", rows.empty() ? "no row" : excerpt(rows.front().second));
  return rate;
}

}  // namespace sila
