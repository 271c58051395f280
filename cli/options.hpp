#pragma once

// Options that several verbs share.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sila/config.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/scene_tracks.hpp"

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
};

/// What is read: the scene, its tracks in their frames, and what became of the rows.
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

/// A verb with --json alone.
CLI::App* add_plain_verb(CLI::App& app, const std::string& name, const std::string& what, const std::string& example,
                         CommonOptions& common);
/// For a verb that has no result to print as one JSON object.
void remove_json(CLI::App& verb);
/// A verb with the options of a configuration, too.
CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& what, const std::string& example,
                   CommonOptions& common);
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
/// The same with the configuration that a model was learnt with as its base; `path` is for messages.
Config configured(const CommonOptions& common, const StoredModel& stored, const std::string& path);

/// Reads tracks and reports their rows on stderr.
ReadTracks read_clean(const TrackOptions& options, const Config& config);

/// Rejects a model file whose episodes are recorded: its tracks may be gone. The file need not exist.
void require_no_records(const std::string& option, const std::string& path);

/// The first line of a file: a secret is given by a file, so that it is in no list of processes.
std::string first_line(const std::string& option, const std::string& path);

/// The picture of --picture as a data URL; empty if none is given. Throws: std::invalid_argument for a scene without a
/// camera.
std::string picture_in(const std::string& verb, const std::string& path, const Scene& scene);
void add_picture(CLI::App& verb, std::string& path);

/// Writes a page to a file, or to stdout if none is named, and its size on stderr.
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

}  // namespace sila::cli
