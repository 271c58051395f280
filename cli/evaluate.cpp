#include "sila/evaluate/evaluate.hpp"

#include <sstream>
#include <stdexcept>

#include "options.hpp"
#include "sila/version.hpp"

namespace sila::cli {
namespace {

struct EvaluateOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string model, predictions;
};

/// Throws: FormatError for a prediction that ends before the horizon.
void require_horizon(const RecordedPredictions& recorded, const std::string& path, double horizon_s) {
  constexpr double kRounding_s = 0.01;
  for (const auto& [of, prediction] : recorded) {
    const double found_s = prediction.times_s.empty() ? 0.0 : prediction.times_s.back();
    if (found_s > horizon_s - kRounding_s) continue;
    std::ostringstream set, horizon;
    set << "one of " << found_s << " s; give --set predict.horizon_s=" << found_s;
    horizon << "predictions of predict.horizon_s = " << horizon_s << " s";
    throw FormatError(path, 0, horizon.str(), set.str());
  }
}

/// Reads predictions, and rejects those of another recording and those of a shorter horizon.
RecordedPredictions predictions_of(const std::string& path, std::span<const FramedTrajectory> tracks,
                                   double horizon_s) {
  RecordedPredictions recorded = read_predictions(path);
  require_horizon(recorded, path, horizon_s);
  const std::size_t others = count_without_track(recorded, tracks);
  const std::string found = std::to_string(others) + " of " + counted(recorded.size(), "prediction") +
                            " without a sample of the same track and time";
  if (2 * others > recorded.size()) throw FormatError(path, 0, "predictions of these tracks", found);
  if (others > 0) warn({path + ": " + found});
  return recorded;
}

/// `path`: the file of the predictions; empty without one.
void require_windows(const Evaluation& evaluation, const std::string& path, std::size_t predictions) {
  if (!evaluation.windows.empty()) return;
  if (!path.empty())
    throw FormatError(path, 0, "predictions of these tracks",
                      std::to_string(predictions) + ", none of them at a sample that can be scored");
  std::string why = "evaluate: no window can be scored";
  for (const auto& [reason, tracks] : evaluation.skipped) why += "; " + counted(tracks, "track") + ": " + reason;
  throw std::invalid_argument(why + "; give longer tracks, or a shorter predict.horizon_s");
}

void evaluate_model(const EvaluateOptions& options) {
  const ThreadLimit limit(options.common.threads);
  const StoredModel stored = load_model(options.model);
  const Config config = configured(options.common, stored, options.model);
  SceneTracks input = read_placed(options.tracks, config, stored.model);
  const RecordedPredictions recorded =
      options.predictions.empty() ? RecordedPredictions{}
                                  : predictions_of(options.predictions, input.tracks, config.episode.predict.horizon_s);
  if (options.tracks.hold_out > 0.0)
    input.tracks = held_out(std::move(input.tracks), options.tracks, options.common).test;
  if (options.predictions.empty()) warn({warning_of_learnt(stored, input.tracks)});
  const Evaluation evaluation =
      options.predictions.empty()
          ? evaluate(stored.model, input.tracks, config.episode, config.evaluate)
          : evaluate_forecast(forecast_of(recorded), input.tracks, config.episode, config.evaluate);
  require_windows(evaluation, options.predictions, recorded.size());
  nlohmann::ordered_json json = to_json(evaluation);
  json["tracks"] = input.tracks.size();
  json["size"] = size(stored.model);
  json["rows"] = to_json(input.report);
  json["sila"] = build_version();
  print(options.common, json,
        counted(input.tracks.size(), "track") + ", model of size " + std::to_string(size(stored.model)) + " from " +
            counted(stored.model.tracks, "track") + " in " + counted(stored.model.episodes, "episode") + "\n" +
            to_text(evaluation));
}

}  // namespace

void add_evaluate(CLI::App& app) {
  const auto [verb, options] = add_verb(app,
                                        {"evaluate", "Score a model's predictions on tracks, beside constant velocity.",
                                         "sila evaluate tracks.csv --scene corner.json --model corner.sila"},
                                        Shared::both, evaluate_model);
  add_tracks(*verb, options->tracks);
  add_hold_out(*verb, options->tracks);
  verb->add_option("--model", options->model, "model file")->required()->type_name("M.sila");
  verb->add_option(
          "--predictions", options->predictions,
          "file of predictions (the output of `sila predict` or `sila serve`) to score instead of those of --model")
      ->type_name("FILE");
}

}  // namespace sila::cli
