#include "sila/fuse/fuse.hpp"

#include <algorithm>
#include <iostream>

#include "options.hpp"
#include "sila/train/episode.hpp"

namespace sila::cli {
namespace {

struct FuseOptions {
  CommonOptions common;
  std::string previous, incoming, out, explain, cases;
};

std::vector<std::filesystem::path> case_files(const std::string& folder) {
  if (!std::filesystem::is_directory(folder)) throw FormatError(folder, 0, "a folder of fusion cases", "none");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) throw FormatError(folder, 0, "fusion cases (*.json)", "no such file");
  return files;
}

/// Runs every case of a folder; prints for each whether the fusion gives exactly the expected result.
void run_cases(const FuseOptions& options) {
  int failed = 0;
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const std::filesystem::path& file : case_files(options.cases)) {
    const FusionCase fusion_case = read_fusion_case(file.string());
    const std::vector<std::string> wrong =
        differences(fusion_case.expect, plan_fusion(fusion_case.problem, fusion_case.rules));
    failed += wrong.empty() ? 0 : 1;
    results.push_back({{"case", file.filename().string()}, {"passed", wrong.empty()}, {"differences", wrong}});
    if (options.common.json) continue;
    std::cout << (wrong.empty() ? "pass  " : "FAIL  ") << file.filename().string() << "\n";
    for (const std::string& line : wrong) std::cout << "      " << line << "\n";
  }
  if (options.common.json) std::cout << results.dump(2) << "\n";
  if (failed > 0)
    throw std::runtime_error(std::to_string(failed) + " of " + std::to_string(results.size()) + " fusion cases failed");
}

void fuse_files(const FuseOptions& options) {
  if (!options.cases.empty()) return run_cases(options);
  if (options.previous.empty() || options.incoming.empty() || options.out.empty()) {
    throw UsageError("fuse: two model files and --out are needed, or --cases");
  }
  require_no_records("--out", options.out);
  if (!options.explain.empty()) require_folder_of(options.explain);
  const ThreadLimit limit(options.common.threads);
  const StoredModel previous = load_model(options.previous), incoming = load_model(options.incoming);
  const Config config = configured(options.common, previous, options.previous);
  require_fitting(previous.model, config.episode);
  require_one_scale(config, configured(CommonOptions{}, incoming, options.incoming));
  const FuseResult fused = fuse_models(previous.model, incoming.model, config.episode.fuse, config.episode.residual);
  warn({warning_of_own_frames(previous.model, incoming.model, fused.model)});
  StoredModel result;
  result.model = fused.model;
  result.configuration = to_json(config).dump();
  result.episodes = joined(previous.episodes, incoming.episodes);
  save_model(options.out, result);
  if (!options.explain.empty()) {
    write_file(options.explain, explain_fusion(options.previous + " + " + options.incoming, fused.problem,
                                               config.episode.fuse, fused.plan)
                                        .dump(1) +
                                    "\n");
  }
  std::cout << options.out << ": " << size(previous.model) << " + " << size(incoming.model) << " -> "
            << size(fused.model) << " (primitives and transitions)\n";
}

}  // namespace

void add_fuse(CLI::App& app) {
  const auto [verb, options] = add_verb(app,
                                        {"fuse", "Fuse two models, or check worked cases of fusion.",
                                         "sila fuse monday.sila tuesday.sila --out both.sila --explain why.json"},
                                        Shared::both, fuse_files);
  verb->add_option("previous", options->previous, "model file")->type_name("A.sila");
  verb->add_option("incoming", options->incoming, "model file")->type_name("B.sila");
  verb->add_option("--out", options->out, "model file to write")->type_name("C.sila");
  verb->add_option("--explain", options->explain, "write what was matched, fused, split and relaxed, and why")
      ->type_name("E.json");
  verb->add_option("--cases", options->cases, "run every case of this folder instead; exit 1 if any fails")
      ->type_name("DIR");
}

}  // namespace sila::cli
