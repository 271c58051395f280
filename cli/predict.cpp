#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <iostream>

#include "options.hpp"
#include "sila/core/companions.hpp"
#include "sila/refine/predictor.hpp"

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
  of_options([&] { validate_fields("predict", config.episode.predict); });
  return config;
}

/// The lines of a track, how many they are, and how many of them are fallbacks.
struct TrackLines {
  std::string text;
  std::size_t count = 0, fallbacks = 0;
};

/// Writes the lines of tracks in their order, each as soon as those before it are written: only a few are in memory.
void write_in_order(std::size_t tracks, const auto& lines_of_track, const auto& write) {
  constexpr std::size_t kTracksAhead = 4;  // of each thread
  using tbb::filter_mode;
  std::size_t next = 0;
  const auto number = [&](tbb::flow_control& flow) {
    if (next < tracks) return next++;
    flow.stop();
    return next;
  };
  tbb::parallel_pipeline(kTracksAhead * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()),
                         tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, number) &
                             tbb::make_filter<std::size_t, TrackLines>(filter_mode::parallel, lines_of_track) &
                             tbb::make_filter<TrackLines, void>(filter_mode::serial_in_order, write));
}

TrackLines lines_of(const FramedTrajectory& placed, const std::string& input_id, const PresentPeople& present,
                    const Predictor& predictor, const Config& config, const PredictOptions& options,
                    const Camera* camera) {
  TrackLines lines;
  Workspace workspace;
  for (std::size_t last : prediction_samples(placed.track, config.episode.predict.min_observe_s, options.stride_s)) {
    const CurbTrajectory observed =
        present.observe(placed.track, last, placed.frame, config.episode.predict.observe_s, config.episode.sampling);
    const Prediction& prediction = predictor.predict(observed, workspace);
    std::optional<Explanation> explanation;
    if (options.explain) explanation = explain(predictor, observed);
    lines.text += prediction_line(input_id, prediction, explanation ? &*explanation : nullptr, camera, options.lines);
    lines.text += '\n';
    ++lines.count;
    lines.fallbacks += prediction.fallback ? 1 : 0;
  }
  return lines;
}

void predict_tracks(const PredictOptions& options) {
  const ThreadLimit limit(options.common.threads);
  const StoredModel stored = load_model(options.model);
  const Config config = predict_config(options, stored);
  const SceneTracks input = read_placed(options.tracks, config, stored.model);
  if (options.image && !input.scene.camera)
    throw UsageError("predict: --image needs --camera, or a scene file with a camera");
  const bool pixels = config.metres_per_pixel > 0.0;
  const Camera* const camera = options.image || pixels ? &*input.scene.camera : nullptr;
  const Predictor predictor(stored.model, config.episode.predict);
  const PresentPeople present(input.tracks);
  std::optional<OutputFile> file;
  if (!options.out.empty()) file.emplace(options.out);
  std::ostream& out = file ? file->stream() : std::cout;
  std::size_t count = 0, fallbacks = 0, too_short = 0;
  const auto lines_of_track = [&](std::size_t i) {
    return lines_of(input.tracks[i], input.input_ids[i], present, predictor, config, options, camera);
  };
  write_in_order(input.tracks.size(), lines_of_track, [&](const TrackLines& lines) {
    out << lines.text;
    count += lines.count;
    fallbacks += lines.fallbacks;
    too_short += lines.count == 0 ? 1 : 0;
  });
  if (file) file->commit();
  std::cerr << counted(count, "prediction") << " for " << counted(input.tracks.size() - too_short, "track");
  if (fallbacks > 0) std::cerr << "; " << fallbacks << " of them without flow fields (fallback)";
  if (too_short > 0) std::cerr << "; " << too_short << " shorter than " << config.episode.predict.min_observe_s << " s";
  if (pixels) std::cerr << "; x and y are metres of " << 1.0 / config.metres_per_pixel << " pixels, u and v are pixels";
  std::cerr << '\n';
}

}  // namespace

void add_predict(CLI::App& app) {
  const auto [verb, options] =
      add_verb(app,
               {"predict", "Predict the next seconds of each track, one JSON object a line.",
                "sila predict tracks.csv --scene corner.json --model corner.sila --out predictions.ndjson"},
               Shared::configuration, predict_tracks);
  add_tracks(*verb, options->tracks);
  verb->add_option("--model", options->model, "model file")->required()->type_name("M.sila");
  verb->add_option("--out", options->out, "file for the predictions [standard output]")->type_name("FILE");
  verb->add_option(
      "--observe", options->observe_s,
      "observed seconds before each prediction [all there are, from predict.min_observe_s to predict.observe_s]");
  verb->add_option("--horizon", options->horizon_s, "predicted seconds [5]");
  verb->add_option("--every", options->stride_s, "seconds between predictions of a track [1]")->check(positive_number);
  add_lines(*verb, options->lines);
  verb->add_flag("!--no-covariances", options->lines.covariances, "leave the covariances out: half as many bytes");
  verb->add_flag("--image", options->image,
                 "add u, v and cov_uv, the path in the picture of the camera [of a model in pixels always]");
  verb->add_flag("--explain", options->explain, "add the primitives, transitions and terms behind each mode");
}

}  // namespace sila::cli
