#include "sila/report/report.hpp"

#include "options.hpp"
#include "sila/version.hpp"

namespace sila::cli {
namespace {

struct ReportOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string subject;  ///< a model file or the results of an experiment
  std::string results;
  std::string picture;
  std::string out;
};

/// What `sila experiment` wrote.
nlohmann::json read_results(const std::string& path) {
  nlohmann::json results = read_json(path);
  if (!results.is_object() || !results.contains("curves"))
    throw FormatError(path, 0, "results of `sila experiment`", "JSON of another kind");
  return results;
}

nlohmann::ordered_json model_data(const ReportOptions& options) {
  ReportInput input;
  input.stored = load_model(options.subject);
  const Config config = configured(options.common, input.stored, options.subject);
  input.name = std::filesystem::path(options.subject).filename().string();
  input.episode = config.episode;
  input.evaluate = config.evaluate;
  input.configuration = to_json(config);
  if (!options.results.empty()) input.results = read_results(options.results);
  if (options.tracks.scene.empty() && options.tracks.paths.empty()) {
    if (!options.picture.empty()) throw UsageError("report: --picture needs tracks");
    if (options.tracks.hold_out > 0.0) throw UsageError("report: --hold-out needs tracks");
    return report_data(input);
  }
  SceneTracks read = read_placed(options.tracks, config, input.stored.model);
  input.picture = picture_in("report", options.picture, read.scene);
  input.scene = std::move(read.scene);
  input.rows = std::move(read.report);
  input.tracks = std::move(read.tracks);
  if (options.tracks.hold_out > 0.0)
    input.tracks = held_out(std::move(input.tracks), options.tracks, options.common).test;
  warn({warning_of_learnt(input.stored, input.tracks)});
  return report_data(input);
}

void make_report(const ReportOptions& options) {
  const ThreadLimit limit(options.common.threads);
  nlohmann::ordered_json data;
  if (std::filesystem::path(options.subject).extension() == ".json") {
    if (!options.picture.empty() || !options.tracks.scene.empty() || !options.tracks.paths.empty() ||
        options.tracks.hold_out > 0.0 || !options.results.empty())
      throw UsageError("report: tracks, --scene, --hold-out, --picture and --results need a model file, not results");
    data = {{"sila", build_version()}, {"name", std::filesystem::path(options.subject).filename().string()}};
    data["results"] = read_results(options.subject);
  } else {
    data = model_data(options);
  }
  write_page(options.common.json ? data.dump(1) + "\n" : report_page(data), options.out);
}

}  // namespace

void add_report(CLI::App& app) {
  const auto [verb, options] =
      add_verb(app,
               {"report", "Show a model, its predictions and its errors as one HTML page that opens offline.",
                "sila report corner.sila later.csv --scene corner.json --out report.html"},
               Shared::both, make_report);
  verb->add_option("subject", options->subject, "model file, or the results.json of `sila experiment`")
      ->required()
      ->type_name("M.sila|RESULTS.json");
  add_tracks(*verb, options->tracks);
  add_hold_out(*verb, options->tracks);
  verb->add_option("--results", options->results, "results.json of `sila experiment`, for the learning curves")
      ->type_name("FILE");
  add_picture(*verb, options->picture);
  verb->add_option("--out", options->out, "HTML file to write [standard output]; with --json its data")
      ->type_name("FILE");
}

}  // namespace sila::cli
