#pragma once

// Options that several verbs share, and the headers that most of them use.

#include "sila/config.hpp"
#include "sila/core/counted.hpp"
#include "sila/core/errors.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/files.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/scene_tracks.hpp"
#include "verbs.hpp"

namespace sila::cli {

inline constexpr const char* kSceneHelp =
    "scene file: where the corner and the curbs are [the frame of the model, made from its first tracks]";

/// The options of most verbs.
struct CommonOptions {
  std::string profile;  ///< replaces that of the configuration file; other settings override its values
  std::string config_file;
  std::vector<std::string> sets;
  int threads = 0;  ///< 0: as many as there are processors
  std::optional<std::uint64_t> seed;
  bool json = false;
};

/// Which tracks, and how to read them.
struct TrackOptions {
  std::vector<std::string> paths;
  std::string scene;
  std::string camera;
  std::string data_dir;
  std::string format;
  ReadOptions read;
  double hold_out = 0.0;
  SplitBy split = SplitBy::time;
  const CLI::App* verb = nullptr;  ///< that has these options
};

/// The result of reading: the scene, its tracks in their frames, and the counts of kept and dropped rows.
struct SceneTracks {
  Scene scene;
  std::vector<FramedTrajectory> tracks;
  std::vector<std::string> input_ids;  ///< of each track, as its rows had them
  TrackReport report;
};

/// The same in world coordinates, before the frame of a corner is chosen; without a scene if none is given.
struct ReadTracks {
  Scene scene;
  CleanTracks tracks;
};

/// The name of a verb, its effect and an example of its use.
struct VerbText {
  std::string name, what, example;
};
/// The shared options of a verb: those of a configuration, and --json if its result can be one JSON object.
enum class Shared { json, configuration, both };
/// A verb and its options, which it owns.
template <class Options>
struct Verb {
  CLI::App* app;
  Options* options;
};
CLI::App* add_plain_verb(CLI::App& app, const VerbText& text, Shared shared, CommonOptions& common);
template <class Options>
Verb<Options> add_verb(CLI::App& app, const VerbText& text, Shared shared, void (*run)(const Options&)) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = add_plain_verb(app, text, shared, options->common);
  verb->callback([options, run] { run(*options); });
  return {verb, options.get()};
}
/// Prints a result for programs (--json) or for people.
void print(const CommonOptions& common, const nlohmann::ordered_json& json, const std::string& text);
void add_tracks(CLI::App& verb, TrackOptions& options);
/// Which tracks are held back.
void add_hold_out(CLI::App& verb, TrackOptions& options);
/// The classes, and the camera of Frigate, that count.
void add_classes(CLI::App& verb, ReadOptions& options);
/// How predictions are written.
void add_lines(CLI::App& verb, LineFormat& format);

/// A check of an option for CLI11: empty, or what is wrong with the text.
std::string positive_number(const std::string& text);

/// `base` with the profile, the configuration file, then the --set assignments, applied.
Config configured(const CommonOptions& common, Config base = {});
/// The same with the configuration that a model was learnt with as its base; `path` is for messages. Throws:
/// std::invalid_argument for another interval of samples than that of the model.
Config configured(const CommonOptions& common, const StoredModel& stored, const std::string& path);

/// Reads tracks and reports their rows on stderr.
ReadTracks read_clean(const TrackOptions& options, const Config& config);

/// Throws: FormatError if the folder of the file does not exist.
void require_folder_of(const std::string& path);
/// Rejects also a model file that has learnt tracks, because they may no longer exist. An empty file, which a failure
/// leaves, counts as new. `may_be_shared`: a model without records of episodes (a k-anonymous copy) may be replaced.
void require_no_records(const std::string& option, const std::string& path, bool may_be_shared = false);
/// Warnings on standard error, one a line; empty texts are left out.
void warn(const std::vector<std::string>& texts);

/// The first line of a file: a secret is given by a file, so that it is in no list of processes.
std::string first_line(const std::string& option, const std::string& path);

/// The picture of --picture as a data URL; empty if none is given. Throws: std::invalid_argument for a scene without a
/// camera.
std::string picture_in(const std::string& verb, const std::string& path, const Scene& scene);
void add_picture(CLI::App& verb, std::string& path);

/// Writes a page to a file, or to stdout if none is named, and its size on stderr. Throws:
/// std::invalid_argument for HTML over a JSON file, e.g. a scene.
void write_page(const std::string& page, const std::string& path);

/// Reads the scene and opens the tracks, to be read part by part.
struct OpenedTracks {
  Scene scene;
  TrackStream stream;
};
OpenedTracks open_tracks(const TrackOptions& options, const Config& config);

/// Prints the counts of kept and dropped rows on stderr.
void tell(const TrackReport& report);

/// Reads tracks, reports their rows on stderr, and puts each in the frame of its corner: of the scene, or
/// without one of the model.
SceneTracks read_placed(const TrackOptions& options, const Config& config, const Model& model);

/// The tracks that --hold-out holds back, and the others.
Split held_out(std::vector<FramedTrajectory> tracks, const TrackOptions& options, const CommonOptions& common);

/// Throws: std::invalid_argument unless a command names tracks.
void require_named(bool tracks);

}  // namespace sila::cli
