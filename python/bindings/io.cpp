#include "bindings.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/io/track_files.hpp"

namespace sila::python {
namespace {

std::string merged_config(const std::string& base, const std::string& changes, const std::string& source) {
  const Config config = read_config(config_of(base), nlohmann::json::parse(changes), source);
  validate_fields("config", config);
  validate(config.episode);
  return to_json(config).dump();
}

/// (path, default, unit, range, meaning) of every field.
std::vector<std::array<std::string, 5>> config_fields() {
  std::vector<std::array<std::string, 5>> rows;
  for (const FieldInfo& field : list_fields(Config{}))
    rows.push_back({field.path, field.value, field.unit, field.range, field.text});
  return rows;
}

std::pair<std::vector<Track>, std::string> read_files(const std::vector<std::filesystem::path>& paths,
                                                      const DrawnScene* scene, const std::optional<std::string>& format,
                                                      std::optional<double> frames_per_second,
                                                      std::optional<double> metres_per_unit,
                                                      const std::optional<std::filesystem::path>& camera,
                                                      const std::vector<std::string>& person_classes,
                                                      const std::string& config) {
  const Config settings = config_of(config);
  ReadOptions options;
  if (format) options.format = required_format(*format, "read_tracks: format = \"" + *format + "\"");
  options.frames_per_second = frames_per_second;
  options.metres_per_unit = metres_per_unit;
  options.camera = pixel_camera(settings, camera || metres_per_unit);
  CameraFile read;
  if (camera) options.camera = (read = read_camera(*camera)).camera;
  options.person_classes = person_classes;
  const Scene place = scene == nullptr ? Scene{} : scene->scene;
  CleanTracks clean = read_tracks(paths, place, options, settings.clean);
  std::ranges::move(read.warnings, std::back_inserter(clean.report.warnings));
  return {tracks_of(std::move(clean.trajectories), clean.input_ids), to_json(clean.report).dump()};
}

void write_csv(const std::filesystem::path& path, const std::vector<Track>& tracks) {
  write_tracks_csv(path, list_of(tracks, &Track::trajectory));
}

}  // namespace

Config config_of(const std::string& json) {
  return read_config(Config{}, nlohmann::json::parse(json), "config");
}

void bind_io(nb::module_& module) {
  module.def("merged_config", &merged_config, "base"_a, "changes"_a, "source"_a,
             "A whole configuration as JSON: the defaults, then base, then changes; checked.");
  module.def(
      "config_from_file", [](const std::filesystem::path& path) { return read_json(path).dump(); }, "path"_a,
      "The JSON of a file, without its comments.");
  module.def("config_fields", &config_fields, "Path, default, unit, range and meaning of every configuration field.");
  module.def("read_files", &read_files, "paths"_a, "scene"_a.none(), "format"_a.none(), "frames_per_second"_a.none(),
             "metres_per_unit"_a.none(), "camera"_a.none(), "person_classes"_a, "config"_a,
             nb::call_guard<nb::gil_scoped_release>(),
             "Tracks of files, or of those that the scene names if there is no path; and the report as JSON.");
  module.def(
      "walking_scale",
      [](const std::vector<Track>& tracks) {
        const auto first = std::span(tracks).first(std::min(tracks.size(), kScaleTracks));
        return walking_scale(list_of(first, &Track::trajectory)).metres_per_pixel;
      },
      "tracks"_a, "Metres per pixel of tracks that were read at TRIAL_METRES_PER_PIXEL.");
  module.def(
      "class_columns", [] { return std::vector<std::string>(kClassColumns.begin(), kClassColumns.end()); },
      "Names of the column of classes in a table; the first that is there is used.");
  module.attr("TRIAL_METRES_PER_PIXEL") = kTrialMetresPerPixel;
  module.def("write_csv", &write_csv, "path"_a, "tracks"_a, nb::call_guard<nb::gil_scoped_release>(),
             "Writes the generic CSV, track_id,t,x,y.");
}

}  // namespace sila::python
