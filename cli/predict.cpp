#include <tbb/parallel_for.h>

#include <iostream>
#include <memory>
#include <stdexcept>

#include "options.hpp"
#include "sila/config.hpp"
#include "sila/core/companions.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/files.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/prediction_json.hpp"
#include "sila/refine/predictor.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct PredictOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string model, out;
  std::optional<double> observe_s, horizon_s;
  double stride_s = 1.0;
  LineFormat lines;
  bool explain = false, image = false;
};

Config predict_config(const PredictOptions& options, const StoredModel& stored) {
  Config config = configured(options.common, stored, options.model);
  if (options.observe_s) config.episode.predict.observe_s = config.episode.predict.min_observe_s = *options.observe_s;
  if (options.horizon_s) config.episode.predict.horizon_s = *options.horizon_s;
  validate_fields("predict", config.episode.predict);
  return config;
}

/// The lines of a track and how many they are.
struct TrackLines {
  std::string text;
  std::size_t count = 0;
};

TrackLines lines_of(const FramedTrajectory& placed, const std::string& input_id, const PresentPeople& present,
                    const Predictor& predictor, const Config& config, const PredictOptions& options,
                    const Camera* camera) {
  TrackLines lines;
  for (std::size_t last : prediction_samples(placed.track, config.episode.predict.min_observe_s, options.stride_s)) {
    CurbTrajectory observed =
        observe(placed.track, last, placed.frame, config.episode.predict.observe_s, config.episode.sampling);
    observed.companions_mps = present.companions_mps(placed.track, last);
    const Prediction prediction = predictor.predict(observed);
    std::optional<Explanation> explanation;
    if (options.explain) explanation = explain(predictor, observed);
    lines.text += prediction_line(input_id, prediction, explanation ? &*explanation : nullptr, camera, options.lines);
    lines.text += '\n';
    ++lines.count;
  }
  return lines;
}

void predict_tracks(const PredictOptions& options) {
  const ThreadLimit limit(options.common.threads);
  const StoredModel stored = load_model(options.model);
  const Config config = predict_config(options, stored);
  const SceneTracks input = read_placed(options.tracks, config, stored.model);
  if (options.image && !input.scene.camera)
    throw std::invalid_argument("predict: --image needs --camera, or a scene file with a camera");
  const bool pixels = config.metres_per_pixel > 0.0;
  const Camera* const camera = options.image || pixels ? &*input.scene.camera : nullptr;
  const Predictor predictor(stored.model, config.episode.predict);
  const PresentPeople present(input.tracks);
  std::vector<TrackLines> lines(input.tracks.size());
  tbb::parallel_for(std::size_t{0}, lines.size(), [&](std::size_t i) {
    lines[i] = lines_of(input.tracks[i], input.input_ids[i], present, predictor, config, options, camera);
  });
  std::optional<OutputFile> file;
  if (!options.out.empty()) file.emplace(options.out);
  std::ostream& out = file ? file->stream() : std::cout;
  std::size_t count = 0, too_short = 0;
  for (const TrackLines& of_track : lines) {
    out << of_track.text;
    count += of_track.count;
    too_short += of_track.count == 0 ? 1 : 0;
  }
  if (file) file->commit();
  std::cerr << count << " predictions for " << input.tracks.size() - too_short << " tracks";
  if (too_short > 0) std::cerr << "; " << too_short << " tracks are shorter than predict.min_observe_s";
  if (pixels) std::cerr << "; x and y are metres of " << 1.0 / config.metres_per_pixel << " pixels, u and v are pixels";
  std::cerr << '\n';
}

}  // namespace

void add_predict(CLI::App& app) {
  auto options = std::make_shared<PredictOptions>();
  CLI::App* verb = add_verb(app, "predict", "Predict the next seconds of each track, one JSON object a line.",
                            "sila predict tracks.csv --scene corner.json --model corner.sila --out predictions.ndjson",
                            options->common);
  add_tracks(*verb, options->tracks);
  verb->add_option("--model", options->model, "model file")->required()->type_name("M.sila");
  verb->add_option("--out", options->out, "file for the predictions [standard output]")->type_name("FILE");
  verb->add_option(
      "--observe", options->observe_s,
      "observed seconds before each prediction [all there are, from predict.min_observe_s to predict.observe_s]");
  verb->add_option("--horizon", options->horizon_s, "predicted seconds [5]");
  verb->add_option("--every", options->stride_s, "seconds between predictions of a track [1]")->check(positive_number);
  add_lines(*verb, options->lines);
  verb->add_flag("--image", options->image,
                 "add u, v and cov_uv, the path in the picture of the camera [of a model in pixels always]");
  verb->add_flag("--explain", options->explain, "add the primitives, transitions and terms behind each mode");
  verb->callback([options] { predict_tracks(*options); });
}

}  // namespace sila::cli
