#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <iostream>
#include <mutex>

#include "options.hpp"
#include "sila/service/server.hpp"

namespace sila::cli {
namespace {

/// The value of --camera for detections in metres.
constexpr const char* kNoCamera = "off";

struct ServeVerb {
  CommonOptions common;
  ServerOptions server;
  std::string scene, model, camera, picture, token_file, mqtt_password_file;
  std::optional<double> stride_s;
  std::optional<int> batch;
  LineFormat lines;
};

/// Writes one line to stderr; may be called from any thread.
void print_message(const std::string& text) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::cerr << text + "\n" << std::flush;
}

/// The model file of the service.
struct OpenModel {
  ModelFile file;
  StoredModel stored;
  Config config;
};

OpenModel open_model(const ServeVerb& options) {
  OpenModel open{ModelFile::open_or_create(options.model), {}, {}};
  if (!open.file.empty()) open.stored = open.file.read();
  open.config = configured(options.common, open.stored, options.model);
  if (options.stride_s) open.config.service.stride_s = *options.stride_s;
  if (options.batch) open.config.service.batch = *options.batch;
  of_options([&] { validate_fields("serve", open.config); });
  open.stored.configuration = to_json(open.config).dump();
  return open;
}

/// The scene given, or that of the model; without a corner for a new model, whose frame is made from its first batch.
Scene corners_in(const ServeVerb& options, const OpenModel& open) {
  const Scene given = options.scene.empty() ? Scene{} : read_scene(options.scene);
  if (given.corners.empty() && open.stored.model.sites.empty()) return given;
  warn({warning_of_moved_corner(open.stored.model, given)});
  return scene_for(given, open.stored.model, {}, open.config.corners);
}

/// The same with the camera of the model or of --camera, if there is one.
Scene scene_in(const ServeVerb& options, const OpenModel& open) {
  Scene scene = corners_in(options, open);
  const bool given = !options.camera.empty() && options.camera != kNoCamera;
  if (const auto camera = pixel_camera(open.config, given)) scene.camera = camera;
  if (scene.camera && options.camera.empty() && !pixel_camera(open.config))
    throw std::invalid_argument("serve: " + options.scene + " has a camera: expected --camera " + options.scene +
                                " if detections are image points, or --camera off if they are metres");
  if (!given) return scene;
  const CameraFile read = read_camera(options.camera);
  for (const std::string& warning : read.warnings) print_message("warning: " + warning);
  scene.camera = read.camera;
  return scene;
}

/// A token is part of an address in `?token=`.
std::string token_in(const std::string& path) {
  std::string token = first_line("--token-file", path);
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || std::strchr("-_.~", c) != nullptr; };
  if (!std::ranges::all_of(token, fits))
    throw std::invalid_argument("serve: --token-file = " + path +
                                ": expected a token of letters, digits, -, _, . and ~ alone, found another character");
  return token;
}

ServerOptions server_options(const ServeVerb& verb, const Scene& scene) {
  ServerOptions options = verb.server;
  if (options.http == "off") options.http.clear();
  if (options.http.empty() && options.tcp.empty() && options.unix_path.empty() && options.mqtt.empty() &&
      !options.standard_input)
    throw UsageError("serve: no input; give --http, --tcp, --unix, --mqtt or --stdin");
  if (!verb.token_file.empty()) options.token = token_in(verb.token_file);
  if (!verb.mqtt_password_file.empty())
    options.mqtt_password = first_line("--mqtt-password-file", verb.mqtt_password_file);
  options.picture = picture_in("serve", verb.picture, scene);
  return options;
}

/// A file that is opened later would take the place of a closed stream.
void require_open_streams() {
  for (const auto& [stream, name] : {std::pair{STDIN_FILENO, "input"}, std::pair{STDOUT_FILENO, "output"}}) {
    if (fcntl(stream, F_GETFD) < 0) throw std::invalid_argument(std::string("serve: standard ") + name + " is closed");
  }
}

void serve(const ServeVerb& options) {
  if (options.server.standard_input) require_open_streams();
  const ThreadLimit limit(options.common.threads);
  std::signal(SIGPIPE, SIG_IGN);  // the service continues when a reader of its output ends
  OpenModel open = open_model(options);
  const Scene scene = scene_in(options, open);
  const OnlineCalibration calibration = calibration_in(open.stored);
  const auto message = [&](const std::string& text) { print_message(options.model + ": " + text); };
  LearnerThread learner(open.stored.model, calibration, open.config.episode, open.config.service,
                        storage_in(open.file, open.stored, open.config.episode, message));
  const auto frame_of = [&](const Trajectory& track) {
    return live_frame(scene, learner.snapshot()->model, track, open.config.corners, open.config.episode.scaling);
  };
  ServiceSettings settings{open.config.service,  open.config.clean, open.config.episode,
                           open.config.evaluate, frame_of,          options.lines};
  if (options.camera != kNoCamera || pixel_camera(open.config)) settings.camera = scene.camera;
  const ServerOptions checked = server_options(options, scene);
  Server server = of_options([&] { return Server(checked, scene, settings, learner, print_message); });
  message(counted(open.stored.model.episodes, "episode") + "; serving");
  server.run();
  if (const std::uint64_t failed = learner.status().failed_episodes; failed > 0)
    throw std::runtime_error("serve: " + counted(failed, "episode") + " failed");
}

void add_mqtt(CLI::App& verb, ServeVerb& options) {
  CLI::Option* mqtt = verb.add_option("--mqtt", options.server.mqtt,
                                      "broker and topic of detections, as in mqtt://host/frigate/events");
  mqtt->type_name("mqtt[s]://[USER@]HOST[:PORT]/TOPIC");
  verb.add_option("--mqtt-out", options.server.mqtt_out, "topic of predictions and reports")
      ->needs(mqtt)
      ->type_name("TOPIC");
  verb.add_option("--mqtt-ca", options.server.mqtt_ca,
                  "file of certificates by which an mqtts broker is checked [those of the system]")
      ->needs(mqtt)
      ->type_name("FILE");
  verb.add_option("--mqtt-password-file", options.mqtt_password_file, "file whose first line is the password of USER")
      ->needs(mqtt)
      ->type_name("FILE");
}

}  // namespace

void add_serve(CLI::App& app) {
  const auto [verb, options] =
      add_verb(app,
               {"serve", "Predict pedestrians from the live detections of a tracker, and learn from them.",
                "sila serve --scene corner.json --model corner.sila --tcp 127.0.0.1:8766"},
               Shared::configuration, serve);
  options->server.http = "127.0.0.1:8765";
  verb->add_option("--scene", options->scene, kSceneHelp)->type_name("FILE");
  verb->add_option("--camera", options->camera,
                   "camera or scene file, if detections are image points [pixels]: its camera makes metres of them; "
                   "off: they are metres, although the scene has a camera")
      ->type_name("FILE|off");
  add_picture(*verb, options->picture);
  verb->add_option("--model", options->model, "model file to create or to continue")->required()->type_name("M.sila");
  verb->add_option("--http", options->server.http,
                   "address of the live page, the metrics and WebSockets, or off [127.0.0.1:8765]")
      ->type_name("ADDRESS:PORT");
  verb->add_option("--tcp", options->server.tcp, "address for detections and predictions")->type_name("ADDRESS:PORT");
  verb->add_option("--unix", options->server.unix_path, "Unix socket for detections and predictions")
      ->type_name("PATH");
  add_mqtt(*verb, *options);
  add_classes(*verb, options->server.read);
  CLI::Option* standard_input =
      verb->add_flag("--stdin", options->server.standard_input,
                     "lines from standard input, predictions to standard output; ends with the input");
  verb->add_flag("--wait", options->server.wait,
                 "standard input waits until predictions and learning are done; for files")
      ->needs(standard_input);
  verb->add_option("--token-file", options->token_file,
                   "file whose first line clients must send; needed if other machines can connect")
      ->type_name("FILE");
  verb->add_option("--every", options->stride_s,
                   "seconds between predictions of a pedestrian [that of the model, else each detection]");
  verb->add_option("--batch", options->batch, "finished tracks that make an episode [that of the model, else 20]");
  add_lines(*verb, options->lines);
}

}  // namespace sila::cli
