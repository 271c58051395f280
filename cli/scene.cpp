#include "sila/io/scene.hpp"

#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <sstream>
#include <utility>

#include "options.hpp"
#include "sila/report/report.hpp"

namespace sila::cli {
namespace {

struct MakeOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string map;
  std::vector<double> map_origin;
};

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// The y axis of a scene that comes without a file is that of its camera.
void take_y_axis(Scene& scene, const TrackOptions& options) {
  if (options.scene.empty() && scene.camera) scene.y_axis = y_axis_of(*scene.camera);
}

/// The proposed corner and its standard errors, as a sentence.
std::string describe(const CornerProposal& made) {
  const CurbFrame& frame = made.frame;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "corner at x = " << frame.origin_m.x()
       << " m, y = " << frame.origin_m.y() << " m (standard error " << made.origin_error_m << " m), at which "
       << counted(made.turning_tracks, "track") << (made.turning_tracks == 1 ? " turns\n" : " turn\n");
  const auto axis = [&](int number, const Vector2& direction, double share, double width_m) {
    const double heading_deg = std::round(std::atan2(direction.y(), direction.x()) * kDegrees) + 0.0;  // no -0
    text << "axis " << number << ": heading " << std::setprecision(0) << heading_deg << " degrees, " << 100.0 * share
         << " % of the distance walked, in a strip of " << std::setprecision(1) << width_m << " m\n";
  };
  axis(1, frame.axis_1, made.share_1, made.widths.width_1_m);
  axis(2, frame.axis_2, made.share_2, made.widths.width_2_m);
  text << "standard error of the headings: " << made.axis_error_rad * kDegrees << " degrees\n";
  text << "tracks show where people turn, not the curb: compare the corner with a picture or a map before use\n";
  return text.str();
}

void propose_scene(const MakeOptions& options) {
  if (!options.map.empty())
    throw UsageError("scene make: --map comes with the Python package; pip install 'sila[map]'");
  const Config config = configured(options.common);
  ReadTracks read = read_clean(options.tracks, config);
  Scene scene = std::move(read.scene);
  take_y_axis(scene, options.tracks);
  const CornerProposal made = propose_corner(read.tracks.trajectories, scene.y_axis == YAxis::down);
  const std::vector<std::string>& paths = options.tracks.paths;
  if (scene.name.empty())
    scene.name = std::filesystem::path(paths.empty() ? options.tracks.scene : paths.front()).stem().string();
  scene.corners = {{"corner", made.frame, made.widths}};
  scene.primary = 0;
  if (!options.common.json) std::cerr << describe(made);
  auto json = nlohmann::json::parse(to_text(scene));
  nlohmann::json& corner = json["corners"][0];
  corner["origin_uncertainty_m"] = made.origin_error_m;
  corner["axis_uncertainty_deg"] = made.axis_error_rad * kDegrees;
  corner["turning_tracks"] = made.turning_tracks;
  std::cout << json.dump(2) << "\n";
}

struct EditOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string picture;
  std::string out;
  bool pixels = false;
};

/// Tracks in pixels are cleaned as if a picture of 1920 pixels were 40 m wide [m/pixel].
constexpr double kCleaningScale = 0.02;

/// The files that are read.
std::vector<std::string> paths_of(const TrackOptions& options, const Scene& scene) {
  std::vector<std::string> paths = options.paths;
  if (paths.empty()) {
    for (const SceneFile& file : scene.files)
      paths.push_back(file.resolved.empty() ? file.path : file.resolved.string());
  }
  require_named(!paths.empty());
  return paths;
}

/// Whether the tracks are image points, by the first file.
bool in_pixels(const EditOptions& options, const Scene& scene, const std::string& path) {
  if (!options.tracks.camera.empty()) return true;
  const SceneFile* entry = matching_entry(scene, path);
  ReadOptions read = entry == nullptr ? options.tracks.read : first_of(options.tracks.read, entry->options);
  if (read.metres_per_unit) return false;
  if (options.pixels || scene.camera) return true;
  if (const auto format = track_format(options.tracks.format)) read.format = format;
  return read_detections(path, read).pixels;
}

/// Says in the scene that tracks in metres are no image points, if a camera is saved with it.
void keep_metres(Scene& scene, const EditOptions& options) {
  for (SceneFile& file : scene.files) {
    if (!scene.camera && !file.options.metres_per_unit) file.options.metres_per_unit = 1.0;
  }
  ReadOptions read = options.tracks.read;
  read.metres_per_unit = read.metres_per_unit.value_or(1.0);
  for (const std::string& path : options.tracks.paths) {
    if (matching_entry(scene, path) == nullptr) scene.files.push_back({path, {}, read, {}});
  }
}

/// The corner of the scene, else the proposed one, else the frame of a model without a scene.
std::string add_corner(EditorInput& input, const std::vector<Trajectory>& tracks) {
  if (!input.scene.corners.empty()) return "The corner is that of " + input.file_name + ".";
  if (input.in_picture && !input.scene.camera) return "";
  try {
    const CornerProposal made = propose_corner(tracks, input.scene.y_axis == YAxis::down);
    input.scene.corners = {{"corner", made.frame, made.widths}};
    return "The corner is where most tracks turn (" + std::to_string(made.turning_tracks) +
           " do); that need not be the curb.";
  } catch (const std::invalid_argument& error) {
    Scene scene = scene_for(input.scene, Model{}, input.tracks, CornerChoice::primary);
    input.scene.corners = std::move(scene.corners);
    return std::string(error.what()) + ". This is the frame that a model without a scene gets.";
  }
}

/// The scene file and, instead of its own, the camera file, as they are.
nlohmann::json files_as_they_are(const TrackOptions& options) {
  nlohmann::json file = options.scene.empty() ? nlohmann::json::object() : read_json(options.scene);
  if (options.camera.empty()) return file;
  const nlohmann::json camera = read_json(options.camera);
  file["camera"] = camera.contains("camera") ? camera.at("camera") : camera;
  return file;
}

EditorInput editor_input(const EditOptions& options) {
  const Config config = configured(options.common);
  EditorInput input;
  if (!options.picture.empty()) input.picture = picture_url(options.picture);
  Scene scene;
  if (!options.tracks.scene.empty()) scene = read_scene(options.tracks.scene, options.tracks.data_dir);
  if (!options.tracks.camera.empty()) scene.camera = read_camera(options.tracks.camera).camera;
  const std::vector<std::string> paths = paths_of(options.tracks, scene);
  const bool pixels = in_pixels(options, scene, paths.front());
  if (pixels && options.picture.empty() && !scene.camera)
    throw UsageError("scene edit: tracks in pixels need --picture FILE, on which the camera is set, or --camera FILE");
  input.in_picture = pixels && !options.picture.empty();
  const double scale = input.in_picture && !scene.camera ? kCleaningScale : 1.0;
  TrackOptions reading = options.tracks;
  if (scale != 1.0) {
    reading.paths = paths;
    reading.read.metres_per_unit = scale;
  }
  ReadTracks read = read_clean(reading, config);
  for (Trajectory& track : read.tracks.trajectories) {
    for (Vector2& position : track.positions_m) position /= scale;
  }
  input.scene = std::move(read.scene);
  take_y_axis(input.scene, options.tracks);
  input.tracks = without_frames(read.tracks.trajectories);
  const std::filesystem::path named = options.tracks.scene.empty() ? paths.front() : options.tracks.scene;
  input.file_name = options.tracks.scene.empty() ? named.stem().string() + ".scene.json" : named.filename().string();
  input.proposal = add_corner(input, read.tracks.trajectories);
  if (input.scene.name.empty()) input.scene.name = named.stem().string();
  if (!options.picture.empty() && !input.in_picture) keep_metres(input.scene, options);
  input.file = files_as_they_are(options.tracks);
  return input;
}

void edit_scene(const EditOptions& options) {
  const nlohmann::ordered_json data = editor_data(editor_input(options));
  write_page(options.common.json ? data.dump(1) + "\n" : editor_page(data), options.out);
}

}  // namespace

void add_scene(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("scene", "Make, print or edit a scene file: the corners of a place.");
  verb->require_subcommand(1);
  verb->footer("`sila scene VERB --help` has an example of each verb.");
  CLI::App* show = verb->add_subcommand("show", "Print the frames of a model as a scene file.");
  show->footer("Example:\n  sila scene show corner.sila > corner.json");
  auto model = std::make_shared<std::string>();
  show->add_option("model", *model, "model file")->required()->type_name("M.sila");
  show->callback([model] { std::cout << to_text(scene_of(load_model(*model).model)); });
  const auto [made, options] =
      add_verb(*verb,
               {"make", "Propose a scene file from tracks: the corner at which most of them turn; or from a map.",
                "sila scene make tracks.csv > corner.json"},
               Shared::both, propose_scene);
  add_tracks(*made, options->tracks);
  CLI::Option* map =
      made->add_option("--map", options->map,
                       "OpenStreetMap or Lanelet2 map: propose its corners and crosswalks (in the Python package)")
          ->type_name("FILE");
  made->add_option("--origin", options->map_origin, "for a map in degrees: the point (0, 0) of the tracks")
      ->expected(2)
      ->type_name("LAT LON")
      ->needs(map);
  const auto [edited, editing] =
      add_verb(*verb,
               {"edit", "Make an HTML page, which opens offline, that edits a scene by hand.",
                "sila scene edit tracks.csv --picture corner.jpg --out editor.html"},
               Shared::both, edit_scene);
  add_tracks(*edited, editing->tracks);
  CLI::Option* picture =
      edited->add_option("--picture", editing->picture, "PNG or JPEG picture of the camera, to place the corner on")
          ->type_name("FILE");
  edited
      ->add_flag("--pixels", editing->pixels,
                 "without a camera: the tracks are image points [as the format of the tracks says]")
      ->needs(picture);
  edited->add_option("--out", editing->out, "HTML file to write [standard output]; with --json its data")
      ->type_name("FILE");
}

}  // namespace sila::cli
