#include <atomic>
#include <csignal>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>

#include "options.hpp"
#include "sila/core/thread_limit.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/episode_json.hpp"
#include "sila/io/model_file.hpp"
#include "sila/serve/online_calibration_json.hpp"
#include "sila/serve/server.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct ServeVerb {
  CommonOptions common;
  ServeOptions serve;
  std::string scene, model, token_file;
  std::optional<double> every_s;
  std::optional<int> batch;
};

/// One line on stderr at a time, whichever thread speaks.
void tell(const std::string& text) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::cerr << text + "\n" << std::flush;
}

/// What must not be lost between the engine, which learns it, and the learner's commits, which keep it.
struct SharedCalibration {
  std::mutex mutex;
  OnlineCalibration online_calibration;
};

struct Kept {
  ModelFile file;
  StoredModel stored;
  Config config;
};

Kept open_model(const ServeVerb& options) {
  Kept kept{ModelFile::open_or_create(options.model), {}, {}};
  if (!kept.file.empty()) kept.stored = kept.file.read();
  kept.config = configured(options.common, kept.stored, options.model);
  if (options.every_s) kept.config.live.every_s = *options.every_s;
  if (options.batch) kept.config.live.batch = *options.batch;
  validate_fields("serve", kept.config);
  return kept;
}

/// Commits an episode with the online calibration of the moment, and says so once it is safe.
void commit(Kept& kept, int number, const Model& previous, const Episode& episode,
            const OnlineCalibration& online_calibration) {
  EpisodeRecord record = record_of(number, previous, episode);
  nlohmann::ordered_json statistics = nlohmann::ordered_json::parse(record.statistics);
  statistics["online_calibration"] = to_json(online_calibration);
  record.statistics = statistics.dump();
  kept.file.commit(episode.model, record, to_json(kept.config).dump());
  tell("episode " + std::to_string(number) + " is kept: " + std::to_string(episode.report.tracks) + " tracks, size " +
       std::to_string(episode.report.size_before) + " -> " + std::to_string(episode.report.size_after));
}

/// What another process put in the file, if it did; `number` becomes that of its last episode.
std::optional<Model> renewed(Kept& kept, const std::string& path, int& number) {
  if (!kept.file.changed_elsewhere()) return std::nullopt;
  StoredModel stored = kept.file.read();
  number = static_cast<int>(stored.episodes.size());
  tell(path + ": changed by another process; going on with its " + std::to_string(number) + " episodes");
  return std::move(stored.model);
}

void serve(const ServeVerb& options) {
  const ThreadLimit limit(options.common.threads);
  std::signal(SIGPIPE, SIG_IGN);  // a reader that goes is no reason to go
  Kept kept = open_model(options);
  ServeOptions listening = options.serve;
  listening.config = kept.config.serve;
  if (listening.http == "off") listening.http.clear();
  if (!options.token_file.empty()) listening.token = read_token(options.token_file);
  const Scene scene = read_scene(options.scene, kept.config.episode.scaling);
  const CornerChoice corners = kept.config.corners;
  LiveSettings settings{kept.config.live, kept.config.clean, kept.config.episode, kept.config.evaluate,
                        [&](const Trajectory& track) { return frame_for(scene, track, corners); }};
  SharedCalibration shared{{}, last_calibration(kept.stored.episodes)};
  int number = static_cast<int>(kept.stored.episodes.size());
  Learner learner(
      kept.stored.model, kept.config.episode, kept.config.live,
      [&](const Model& previous, const Episode& episode) {
        std::unique_lock lock(shared.mutex);
        const OnlineCalibration online_calibration = shared.online_calibration;
        lock.unlock();
        commit(kept, number + 1, previous, episode, online_calibration);
        ++number;
      },
      [&] { return renewed(kept, options.model, number); });
  {
    Server server(
        listening, scene, settings, learner, shared.online_calibration,
        [&](const OnlineCalibration& online_calibration) {
          const std::lock_guard lock(shared.mutex);
          shared.online_calibration = online_calibration;
        },
        tell);
    tell(options.model + ": " + std::to_string(kept.stored.model.episodes) + " episodes; serving");
    if (server.run()) learner.learn_rest();
  }
  if (learner.learning().busy) tell("finishing the episode");
}

}  // namespace

void add_serve(CLI::App& app) {
  auto options = std::make_shared<ServeVerb>();
  options->serve.http = "127.0.0.1:8765";
  CLI::App* verb = add_verb(app, "serve", "Predict a tracker's detections as they come, and learn while predicting.",
                            "sila serve --scene corner.json --model corner.sila --tcp 127.0.0.1:8766", options->common);
  verb->add_option("--scene", options->scene, "scene file: where the corner and the curbs are")
      ->required()
      ->type_name("FILE");
  verb->add_option("--model", options->model, "model file to make or to go on with")->required()->type_name("M.sila");
  verb->add_option("--http", options->serve.http,
                   "where the live page, the metrics and WebSockets are, or off [127.0.0.1:8765]")
      ->type_name("ADDRESS:PORT");
  verb->add_option("--tcp", options->serve.tcp, "where lines come in and go out")->type_name("ADDRESS:PORT");
  verb->add_option("--unix", options->serve.unix_path, "the same, a socket in the file system")->type_name("PATH");
  verb->add_flag("--stdin", options->serve.standard_input,
                 "lines from standard input, predictions to standard output; ends with the input");
  verb->add_flag("--wait", options->serve.wait, "standard input waits until it is answered; for files");
  verb->add_option("--token-file", options->token_file,
                   "file whose first line clients must show; needed to listen beyond this machine")
      ->type_name("FILE");
  verb->add_option("--every", options->every_s, "seconds between predictions of a pedestrian [each detection]");
  verb->add_option("--batch", options->batch, "finished tracks that make an episode [20]");
  verb->callback([options] { serve(*options); });
}

}  // namespace sila::cli
