#include "sila/sim/simulate.hpp"

#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>

#include "options.hpp"
#include "sila/io/track_files.hpp"

namespace sila::cli {
namespace {

struct SimulateOptions {
  CommonOptions common;
  std::string layout, out;
  std::optional<int> tracks;
};

/// The scene file that belongs to a track file: tracks.csv -> tracks.scene.json.
std::filesystem::path scene_path(std::filesystem::path tracks) {
  return tracks.replace_extension(".scene.json");
}

Scene scene_of(const Simulation& simulation, const std::filesystem::path& tracks) {
  Scene scene = scene_of(simulation.scene);
  scene.files.push_back({tracks.filename().string(), {}, {.format = TrackFormat::csv}, {}});
  return scene;
}

/// Rejects a standard stream, and a file of tracks without a scene file beside it, which no simulation wrote.
void require_own_tracks(const std::string& out) {
  if (out == "-" || out.starts_with("/dev/"))
    throw UsageError("simulate: --out = " + out + ": expected a file, beside which its scene file is written");
  require_folder_of(out);
  if (std::filesystem::is_regular_file(out) && !std::filesystem::exists(scene_path(out)))
    throw std::invalid_argument("simulate: expected no tracks of another origin at " + out +
                                ", which would be lost; name another --out, or move that file");
}

void require_no_other_scene(const std::filesystem::path& path, const Scene& scene) {
  std::ifstream file(path);
  if (file && std::string(std::istreambuf_iterator<char>(file), {}) != to_text(scene))
    throw std::invalid_argument("simulate: expected no other scene at " + path.string() +
                                ", which would be lost; name another --out, or move that file");
}

void simulate_tracks(const SimulateOptions& options) {
  Config config = configured(options.common);
  of_options([&] {
    if (!options.layout.empty()) config = set_field(config, "simulate.layout=" + options.layout);
    if (options.tracks) config = set_field(config, "simulate.tracks=" + std::to_string(*options.tracks));
  });
  require_own_tracks(options.out);
  const Simulation simulation = simulate(config.simulate);
  const Scene scene = scene_of(simulation, options.out);
  require_no_other_scene(scene_path(options.out), scene);
  write_tracks_csv(options.out, simulation.tracks);
  write_scene(scene_path(options.out), scene);
  std::cerr << counted(simulation.tracks.size(), "track") << " in " << options.out << ", scene in "
            << scene_path(options.out).string() << "\n";
}

}  // namespace

void add_simulate(CLI::App& app) {
  const auto [verb, options] = add_verb(app,
                                        {"simulate", "Make tracks of pedestrians at a simulated intersection.",
                                         "sila simulate --layout four-way --tracks 989 --seed 1 --out tracks.csv"},
                                        Shared::configuration, simulate_tracks);
  verb->add_option("--layout", options->layout, "four-way, t-junction, acute or obtuse [four-way]")->type_name("NAME");
  verb->add_option("--tracks", options->tracks, "number of tracks [989]");
  verb->add_option("--out", options->out, "track file to write; its scene file is written beside it")
      ->required()
      ->type_name("FILE");
}

}  // namespace sila::cli
