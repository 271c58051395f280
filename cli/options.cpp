#include "options.hpp"

#include <fstream>
#include <iostream>
#include <set>

#include "sila/report/report.hpp"

namespace sila::cli {
namespace {

/// The scene and the track files that the options of a verb name, and how to read them.
struct Named {
  Scene scene;
  std::vector<std::filesystem::path> paths;
  ReadOptions read;
};

/// Rejects standard input, which cannot be read twice as some formats are, and a file whose tracks would count twice.
void require_different_files(const std::vector<std::filesystem::path>& paths) {
  std::set<std::filesystem::path> different;
  for (const std::filesystem::path& path : paths) {
    if (path == "-")
      throw UsageError(
          "tracks: expected files, found -; write the tracks to a file, or send lines to `sila serve --stdin`");
    std::error_code error;
    if (!different.insert(std::filesystem::weakly_canonical(path, error)).second)
      throw UsageError("tracks: expected each file once, found " + path.string() + " twice");
  }
}

/// Whether both name one file, which need not exist yet; a device is no file.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(a, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) return false;
  return a == b || std::filesystem::equivalent(a, b, error);
}

/// The options of a verb that name files to write, as far as they are given.
std::vector<const CLI::Option*> outputs_of(const CLI::App& verb) {
  std::vector<const CLI::Option*> outputs;
  for (const char* name : {"--out", "--share", "--explain"}) {
    const CLI::Option* output = verb.get_option_no_throw(name);
    if (output != nullptr && output->get_expected_max() > 0 && output->count() > 0) outputs.push_back(output);
  }
  return outputs;
}

void require_other_file(const CLI::Option& output, const std::filesystem::path& path, const std::string& user) {
  const std::string written = output.as<std::string>();
  if (same_file(written, path))
    throw UsageError(output.get_name() + " = " + written + " is the file of " + user + ", too; name another file");
}

Named named_in(const TrackOptions& options, const Config& config) {
  Named result{{}, {options.paths.begin(), options.paths.end()}, options.read};
  require_named(!result.paths.empty() || !options.scene.empty());
  require_different_files(result.paths);
  if (!options.format.empty()) {
    result.read.format = of_options([&] { return required_format(options.format, "--format = " + options.format); });
  }
  if (!options.scene.empty()) result.scene = read_scene(options.scene, options.data_dir);
  for (const CLI::Option* output : outputs_of(*options.verb)) {
    for (const SceneFile& file : result.scene.files) require_other_file(*output, file.resolved, options.scene);
  }
  const bool has_scale = !options.camera.empty() || options.read.metres_per_unit || result.scene.camera;
  if (const auto camera = pixel_camera(config, has_scale)) result.scene.camera = result.read.camera = camera;
  if (!options.camera.empty()) {
    CameraFile read = read_camera(options.camera);
    result.scene.camera = read.camera;
    result.read.camera = read.camera;
    result.scene.warnings.insert(result.scene.warnings.end(), read.warnings.begin(), read.warnings.end());
  }
  warn(result.scene.warnings);
  return result;
}

void require_valid(const Config& config) {
  validate_fields("config", config);
  validate(config.episode);
}

bool is_database(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;  // reading would wait for a pipe
  constexpr std::string_view begin = "SQLite format 3";
  std::string found(begin.size(), '\0');
  return std::ifstream(path, std::ios::binary).read(found.data(), begin.size()) && found == begin;
}

/// Rejects a file that would be written over another file of the same command, or a text over a model.
void require_own_outputs(const CLI::App& verb) {
  for (const CLI::Option* output : outputs_of(verb)) {
    const std::string path = output->as<std::string>();
    const bool is_model = output->get_type_name().ends_with(".sila");
    if (!is_model && is_database(path))
      throw std::invalid_argument(output->get_name() + " = " + path +
                                  " is a model, which would be lost; name another file");
    for (const CLI::Option* other : verb.get_options()) {
      if (other == output) continue;
      for (const std::string& value : other->results()) require_other_file(*output, value, other->get_name());
    }
  }
}

/// Replaces a name by the number of its value.
template <class Value>
auto named_value(const std::map<std::string, Value>& values) {
  return [values](const std::string& name) {
    const auto found = values.find(name);
    if (found != values.end()) return std::to_string(static_cast<int>(found->second));
    std::string known;
    for (const auto& [other, value] : values) known += (known.empty() ? "" : " or ") + other;
    throw CLI::ValidationError("expected " + known + ", found " + name);
  };
}

}  // namespace

std::string positive_number(const std::string& text) {
  double number = 0.0;
  const bool is_number = CLI::detail::lexical_cast(text, number);
  return is_number && number > 0.0 ? "" : "expected a positive number, found " + text;
}

CLI::App* add_plain_verb(CLI::App& app, const VerbText& text, Shared shared, CommonOptions& common) {
  CLI::App* verb = app.add_subcommand(text.name, text.what);
  verb->footer("Example:\n  " + text.example);
  verb->parse_complete_callback([verb] { require_own_outputs(*verb); });
  if (shared != Shared::configuration) verb->add_flag("--json", common.json, "print the result as JSON");
  if (shared == Shared::json) return verb;
  verb->add_option("--config", common.config_file, "JSON file with configuration values")->type_name("FILE");
  verb->add_option("--profile", common.profile, "initial values: default, paper or paper-literal")->type_name("NAME");
  verb->add_option("--set", common.sets,
                   "set one configuration value, e.g. fuse.similarity_threshold=0.5; see `sila config`")
      ->type_name("PATH=VALUE");
  verb->add_option("--threads", common.threads, "maximum number of threads [the number of processors]")
      ->check(CLI::Range(1, 1024));
  verb->add_option("--seed", common.seed, "seed of `simulate` and of --hold-out; nothing else is random")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53));
  return verb;
}

void print(const CommonOptions& common, const nlohmann::ordered_json& json, const std::string& text) {
  std::cout << (common.json ? json.dump(2) + "\n" : text);
}

void add_classes(CLI::App& verb, ReadOptions& options) {
  verb.add_option(
          "--person", options.person_classes,
          "class of pedestrians: a name in any case, or a number; may be repeated [person, pedestrian, ..., and "
          "the number of the format]")
      ->type_name("CLASS");
  verb.add_option("--frigate-camera", options.frigate_camera, "Frigate camera whose events are used")
      ->type_name("NAME");
}

void add_tracks(CLI::App& verb, TrackOptions& options) {
  options.verb = &verb;
  verb.add_option("tracks", options.paths, "track files or folders; without any, the files that the scene names")
      ->type_name("TRACKS");
  verb.add_option("--scene", options.scene, kSceneHelp)->type_name("FILE");
  CLI::Option* camera =
      verb.add_option("--camera", options.camera, "camera file, by which pixels become metres [that of the scene]");
  camera->type_name("FILE");
  add_classes(verb, options.read);
  verb.add_option("--data-dir", options.data_dir, "also look here for the files that the scene names")
      ->type_name("DIR");
  verb.add_option("--format", options.format, "format of the tracks [recognised by content]");
  verb.add_option("--fps", options.read.frames_per_second, "frames per second, for files with frame numbers")
      ->check(positive_number);
  verb.add_option("--metres-per-unit", options.read.metres_per_unit,
                  "scale of the positions, e.g. metres per pixel [1]")
      ->check(positive_number)
      ->excludes(camera);
}

void add_hold_out(CLI::App& verb, TrackOptions& options) {
  CLI::Option* hold_out =
      verb.add_option("--hold-out", options.hold_out,
                      "share of the tracks held back by --seed: `learn` leaves them out, `evaluate` scores only them");
  hold_out->check(CLI::Range(0.0, 0.99));
  verb.add_option("--split", options.split,
                  "how --hold-out chooses: a block of time with an embargo, or by track [time]")
      ->needs(hold_out)
      ->transform(named_value(std::map<std::string, SplitBy>{{"time", SplitBy::time}, {"track", SplitBy::track}}))
      ->type_name("time|track");
}

void add_lines(CLI::App& verb, LineFormat& format) {
  verb.add_option("--digits", format.digits,
                  "decimals of metres and seconds; shares, levels and covariances have one more; 17: all in full [3]")
      ->check(CLI::Range(1, 17));
  verb.add_option("--lines", format.v1, "v1: the times in each mode, every number in full [v2]")
      ->transform(named_value(std::map<std::string, bool>{{"v1", true}, {"v2", false}}))
      ->type_name("v1|v2");
  verb.add_flag(
      "--outcomes", format.outcomes,
      "add the probabilities that the person stays, goes straight on, left, right or back, and that a path comes "
      "nearest");
}

Config configured(const CommonOptions& common, Config base) {
  Config config = common.profile.empty() ? base : of_options([&] { return with_profile(base, common.profile); });
  if (!common.config_file.empty()) {
    nlohmann::json file = read_json(common.config_file);
    if (!common.profile.empty() && file.is_object()) file.erase("profile");
    config = read_config(config, file, common.config_file);
    require_valid(config);
  }
  of_options([&] {
    for (const std::string& assignment : common.sets) config = set_field(config, assignment);
    if (common.seed) config.simulate.seed = *common.seed;
    require_valid(config);
  });
  return config;
}

Config configured(const CommonOptions& common, const StoredModel& stored, const std::string& path) {
  const Config config = configured(common, config_of(stored, path));
  require_same_units(stored, config);
  return config;
}

void tell(const TrackReport& report) {
  for (const std::string& line : to_lines(report)) std::cerr << line << "\n";
}

ReadTracks read_clean(const TrackOptions& options, const Config& config) {
  const Named named = named_in(options, config);
  ReadTracks result{named.scene, read_tracks(named.paths, named.scene, named.read, config.clean)};
  tell(result.tracks.report);
  return result;
}

OpenedTracks open_tracks(const TrackOptions& options, const Config& config) {
  const Named named = named_in(options, config);
  return {named.scene, TrackStream(named.paths, named.scene, named.read, config.clean)};
}

void require_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::is_directory(folder)) throw FormatError(path, 0, "a file in a folder that exists", "no folder");
}

void require_no_records(const std::string& option, const std::string& path, bool may_be_shared) {
  require_folder_of(path);
  std::error_code error;
  if (!std::filesystem::exists(path) || std::filesystem::file_size(path, error) == 0) return;
  const StoredModel old = load_model(path);
  if (old.episodes.empty() && (may_be_shared || old.model.tracks == 0)) return;
  throw std::invalid_argument(
      option + " = " + path + " is a model of " +
      (old.episodes.empty() ? counted(old.model.tracks, "track") : counted(old.episodes.size(), "recorded episode")) +
      ", which would be lost; name another file, or remove it first");
}

void warn(const std::vector<std::string>& texts) {
  for (const std::string& text : texts)
    if (!text.empty()) std::cerr << "warning: " << text << "\n";
}

std::string picture_in(const std::string& verb, const std::string& path, const Scene& scene) {
  if (path.empty()) return {};
  if (!scene.camera)
    throw UsageError(verb + ": --picture needs --camera, a scene file with a camera, or a model in pixels");
  return picture_url(path);
}

void add_picture(CLI::App& verb, std::string& path) {
  verb.add_option("--picture", path, "PNG or JPEG picture of the camera, on which predictions are drawn")
      ->type_name("FILE");
}

void write_page(const std::string& page, const std::string& path) {
  std::error_code error;
  char first = 0;
  if (std::filesystem::is_regular_file(path, error)) std::ifstream(path) >> first;
  if (first == '{' && !page.starts_with('{'))
    throw std::invalid_argument("--out = " + path + " is a JSON file, which would be lost; name another file");
  if (path.empty())
    std::cout << page;
  else
    write_file(path, page);
  std::cerr << page.size() / 1024 << " KiB" << (path.empty() ? "" : " in " + path) << "\n";
}

std::string first_line(const std::string& option, const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line) || line.empty())
    throw std::invalid_argument(option + " = " + path + " cannot be read or begins with an empty line");
  return line;
}

void require_named(bool tracks) {
  if (!tracks) throw UsageError("tracks: expected track files, or --scene with a file that names some; found neither");
}

SceneTracks read_placed(const TrackOptions& options, const Config& config, const Model& model) {
  ReadTracks read = read_clean(options, config);
  SceneTracks result;
  result.report = std::move(read.tracks.report);
  result.input_ids = std::move(read.tracks.input_ids);
  result.tracks = without_frames(std::move(read.tracks.trajectories));
  result.scene = scene_for(read.scene, model, result.tracks, config.corners);
  place(result.tracks, result.scene, config.corners, config.episode.scaling);
  warn({warning_of_moved_corner(model, result.scene), warning_of_another_place(model, result.tracks)});
  return result;
}

Split held_out(std::vector<FramedTrajectory> tracks, const TrackOptions& options, const CommonOptions& common) {
  return split_tracks(std::move(tracks), options.hold_out, common.seed.value_or(1), options.split);
}

}  // namespace sila::cli
