#include <algorithm>
#include <cctype>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <memory>
#include <sstream>

#include "experiment_file.hpp"
#include "sila/core/errors.hpp"
#include "sila/core/thread_limit.hpp"
#include "sila/experiment/report.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/files.hpp"
#include "sila/version.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

/// Tells builds of one version apart; empty where a program cannot read itself.
std::string build_hash() {
  std::ifstream program("/proc/self/exe", std::ios::binary);
  if (!program) return "";
  const std::string bytes{std::istreambuf_iterator<char>(program), {}};
  return hash_of(bytes);
}

std::string file_name(const Job& job) {
  std::ostringstream name;
  name << std::setfill('0') << std::setw(3) << job.trial;
  if (job.order > 0) name << "-" << std::setw(3) << job.order;
  name << "-" << job.scene << "-" << job.method;
  std::string text = name.str();
  for (char& c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '.') c = '_';
  }
  return text + ".json";
}

/// What the result of a job depends on. Trials that are added later leave the earlier ones as they are.
ordered_json key_of(const ReadExperiment& read, const Job& job, const std::string& build) {
  const ExperimentConfig& config = read.experiment.config;
  ordered_json settings = to_json(config);
  settings.erase("trials"), settings.erase("bootstraps");
  ordered_json key{{"version", SILA_VERSION}, {"build", build}, {"experiment", hash_of(settings.dump())}};
  const bool one = config.kind == ExperimentKind::one_place;
  std::string tracks;
  for (std::size_t p = 0; p < read.track_hashes.size(); ++p) {
    if (!one || p == job.place) tracks += read.experiment.places[p].name + read.track_hashes[p];
  }
  key["tracks"] = hash_of(tracks);
  const Method& method = method_of(read.experiment, job);
  const ordered_json how{to_json(method.config),
                         to_json(method.memory),
                         to_json(method.cliff),
                         to_json(method.tree),
                         to_json(read.experiment.places[job.place].evaluate),
                         kMethodKinds[static_cast<std::size_t>(method.kind)]};
  key["method"] = hash_of(how.dump());
  return key;
}

/// The first thing in which two keys differ.
std::string difference_of(const json& kept, const json& wanted) {
  const std::pair<const char*, const char*> names[] = {{"version", "version of sila"},
                                                       {"experiment", "setting of the experiment"},
                                                       {"tracks", "set of tracks"},
                                                       {"method", "configuration of the method"},
                                                       {"build", "build of sila"}};
  for (const auto& [key, text] : names) {
    if (kept.value(key, "") != wanted.value(key, "")) return std::string("another ") + text;
  }
  return "something else";
}

/// The part of an earlier run, if it is there and of the same making.
std::optional<json> kept_part(const fs::path& path, const ordered_json& key, bool redo) {
  if (!fs::exists(path)) return std::nullopt;
  if (redo) {
    try {
      json part = read_json(path);
      if (part.value("key", json()) == json(key)) return part;
    } catch (const FormatError&) {  // half a file is made anew as well
    }
    return std::nullopt;
  }
  json part = read_json(path);
  if (part.value("key", json()) == json(key)) return part;
  throw std::invalid_argument("experiment: " + path.string() + " was made with " +
                              difference_of(part.value("key", json::object()), key) +
                              "; name another --out, or say --redo to make such parts anew");
}

std::string told(const Job& job, const json& part) {
  std::ostringstream line;
  line << std::fixed << std::setprecision(3);
  const std::vector<PartRow> rows = rows_of(part);
  const PartRow& row = rows.back();
  for (const RowValue& value : row_values()) {
    const std::string name = value.name;
    const std::optional<double> number = value.of(row);
    if (number && (name == "ratio" || name == "mean_path_ratio")) line << ", " << value.title << " " << *number;
  }
  line << ", size " << row.size << ", " << row.seconds_per_episode << " s per episode";
  return "trial " + std::to_string(job.trial) + (job.order > 0 ? ", order " + std::to_string(job.order) : "") + ", " +
         job.scene + ", " + job.method + line.str();
}

json done(const ReadExperiment& read, const Job& job) {
  try {
    return part_json(job, run_course(course_of(read.experiment, job), method_of(read.experiment, job)));
  } catch (const std::exception& error) {
    throw std::runtime_error("experiment: trial " + std::to_string(job.trial) + ", " + job.scene + ", " + job.method +
                             ": " + error.what() + "; what was finished is kept");
  }
}

ordered_json orders_json(const Experiment& experiment) {
  ordered_json list = ordered_json::array();
  for (const auto& order : orders_of(experiment.places.size(), experiment.config.orders, experiment.config.seed)) {
    ordered_json names = ordered_json::array();
    for (std::size_t p : order) names.push_back(experiment.places[p].name);
    list.push_back(std::move(names));
  }
  return list;
}

void write_results(const fs::path& out, const ReadExperiment& read, const std::vector<json>& parts,
                   const std::string& build, const std::string& file) {
  std::vector<PartRow> rows;
  for (const json& part : parts) std::ranges::move(rows_of(part), std::back_inserter(rows));
  const ExperimentConfig& config = read.experiment.config;
  const std::vector<MethodSummary> summaries = summarise(rows);
  const std::vector<Comparison> comparisons = compare(rows, read.reference, config.bootstraps, config.seed);
  ordered_json results{{"version", SILA_VERSION},
                       {"build", build},
                       {"command", "sila experiment " + file + " --trials " + std::to_string(config.trials)},
                       {"seed", config.seed},
                       {"experiment", read.resolved}};
  if (config.kind == ExperimentKind::places) results["orders"] = orders_json(read.experiment);
  results["summary"] = to_json(std::span<const MethodSummary>(summaries));
  results["comparisons"] = to_json(std::span<const Comparison>(comparisons));
  results["curves"] = curves_json(parts);
  write_file(out / "results.json", results.dump(1) + "\n");
  write_file(out / "results.csv", rows_csv(rows));
  write_file(out / "curves.csv", curves_csv(parts));
  const int finished = parts.back().at("trial");  // they come in order
  const std::string trials =
      std::to_string(finished) + (finished < config.trials ? " of " + std::to_string(config.trials) : "") + " trials";
  write_file(out / "table.md", "# " + fs::path(file).stem().string() + "\n\nsila " SILA_VERSION ", " + trials +
                                   ", seed " + std::to_string(config.seed) + ", split by " +
                                   kSplitBy[static_cast<std::size_t>(config.split)] + ".\n\n" +
                                   tables(summaries, comparisons));
}

void run_experiment(const ExperimentOptions& options) {
  const ThreadLimit limit(options.common.threads);
  const ReadExperiment read = read_experiment(options);
  const std::string build = build_hash();
  const std::vector<Job> jobs = jobs_of(read.experiment);
  const fs::path out = options.out;
  fs::create_directories(out / "parts");
  std::vector<std::optional<json>> kept;
  for (const Job& job : jobs)
    kept.push_back(kept_part(out / "parts" / file_name(job), key_of(read, job, build), options.redo));
  const auto already = std::ranges::count_if(kept, [](const auto& part) { return part.has_value(); });
  if (already > 0) std::cerr << already << " of " << jobs.size() << " parts are there from an earlier run\n";
  std::vector<json> parts;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!kept[i]) {
      json part = done(read, jobs[i]);
      part["key"] = key_of(read, jobs[i], build);
      write_file(out / "parts" / file_name(jobs[i]), part.dump() + "\n");
      std::cerr << i + 1 << "/" << jobs.size() << ": " << told(jobs[i], part) << "\n";
      kept[i] = std::move(part);
    }
    parts.push_back(std::move(*kept[i]));
    const bool last = i + 1 == jobs.size();
    if (last || jobs[i + 1].trial != jobs[i].trial) write_results(out, read, parts, build, options.file);
  }
  if (options.common.json) std::cout << read_json(out / "results.json").at("summary").dump(2) << "\n";
  std::cerr << "results in " << (out / "table.md").string() << ", results.json, results.csv, curves.csv\n";
}

}  // namespace

void add_experiment(CLI::App& app) {
  auto options = std::make_shared<ExperimentOptions>();
  CLI::App* verb = add_verb(app, "experiment", "Compare methods on scenes, trial by trial; an interrupted run goes on.",
                            "sila experiment experiments/smoke.json --out out/smoke", options->common);
  verb->add_option("file", options->file, "experiment file (docs/experiments.md)")->required()->type_name("FILE");
  verb->add_option("--out", options->out, "folder for the results; parts that are there already are kept")
      ->required()
      ->type_name("DIR");
  verb->add_option("--data-dir", options->data_dir, "also look here for scene files and the files that they name")
      ->type_name("DIR");
  verb->add_option("--trials", options->trials, "how many trials, instead of what the file says")
      ->check(CLI::Range(1, 10000));
  verb->add_option("--split", options->split, "time or track, instead of what the file says")
      ->transform(CLI::CheckedTransformer(split_names()));
  verb->add_flag("--redo", options->redo, "make parts anew that another configuration or build has made");
  verb->callback([options] { run_experiment(*options); });
}

}  // namespace sila::cli
