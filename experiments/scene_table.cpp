// Learns and judges every scene of a list with SILA, accumulate and batch learning, on the same seeded splits, and
// prints a table.
//
//   scene_table experiments/scenes.json DATA_DIR [TRIALS] [SCENE...]  > table.md
//
// Tracks are split by track (15 % held back); the order of the rest is the seed's too. Constant velocity is judged on
// the same windows.

#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sila/config.hpp"
#include "sila/eval/episodes.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/scene_tracks.hpp"

namespace {

constexpr double kHeldBack = 0.15;
constexpr std::size_t kBatch = 20;

struct Entry {
  std::string name;
  std::filesystem::path scene;
  sila::Config config;
};

/// Mean and standard deviation over trials.
struct Spread {
  std::vector<double> values;
  double mean() const {
    double sum = 0.0;
    for (double v : values) sum += v;
    return values.empty() ? std::nan("") : sum / static_cast<double>(values.size());
  }
  double deviation() const {
    double sum = 0.0;
    for (double v : values) sum += (v - mean()) * (v - mean());
    return values.size() < 2 ? 0.0 : std::sqrt(sum / static_cast<double>(values.size() - 1));
  }
};

/// One row of the table: what a method gave, trial by trial.
struct MethodScore {
  Spread windows, turning_windows, size, seconds, mhd_m, constant_mhd_m, ratio, turning_ratio, mean_path_ratio,
      best_ratio, fallback, nll, constant_nll;
};

std::vector<sila::PlacedTrack> placed(const sila::Scene& scene, const sila::Config& config) {
  sila::CleanTracks clean = sila::read_scene_tracks(scene, config.clean);
  std::vector<sila::PlacedTrack> tracks;
  for (sila::Trajectory& track : clean.trajectories) {
    const std::size_t corner =
        config.corners == sila::CornerChoice::nearest ? sila::nearest_corner(scene, track) : scene.primary;
    tracks.push_back({std::move(track), scene.corners[corner].frame});
  }
  return tracks;
}

sila::Run run_method(const std::string& method, const std::vector<sila::PlacedTrack>& train,
                     const sila::EpisodeConfig& config) {
  if (method == "batch") return sila::learn_at_once(train, config);
  const sila::Update update = method == "accumulate" ? sila::accumulate_update(config) : sila::sila_update(config);
  return sila::run_episodes({}, train, kBatch, config, update);
}

void score(MethodScore& row, const sila::Run& run, const std::vector<sila::PlacedTrack>& test,
           const sila::Config& config) {
  const sila::Evaluation evaluation = sila::evaluate(run.model, test, config.episode, config.evaluate);
  const sila::GroupScore &moving = evaluation.groups[1], &turning = evaluation.groups[2];
  double seconds = 0.0;
  for (const sila::EpisodeReport& episode : run.episodes) seconds += episode.seconds;
  row.windows.values.push_back(static_cast<double>(moving.windows));
  row.turning_windows.values.push_back(static_cast<double>(turning.windows));
  row.size.values.push_back(static_cast<double>(sila::size(run.model)));
  row.seconds.values.push_back(seconds / static_cast<double>(run.episodes.size()));
  if (moving.windows == 0) return;
  const sila::Metrics &model = moving.model.back(), &constant = moving.constant.back();
  row.mhd_m.values.push_back(model.weighted_mhd_m);
  row.constant_mhd_m.values.push_back(constant.weighted_mhd_m);
  row.ratio.values.push_back(model.weighted_mhd_m / constant.weighted_mhd_m);
  row.mean_path_ratio.values.push_back(model.mean_path_mhd_m / constant.weighted_mhd_m);
  row.best_ratio.values.push_back(model.best_mhd_m / constant.weighted_mhd_m);
  row.fallback.values.push_back(moving.fallback_rate);
  row.nll.values.push_back(model.nll);
  row.constant_nll.values.push_back(constant.nll);
  if (turning.windows > 0) {
    row.turning_ratio.values.push_back(turning.model.back().weighted_mhd_m / turning.constant.back().weighted_mhd_m);
  }
}

std::vector<Entry> read_entries(const std::filesystem::path& list) {
  std::vector<Entry> entries;
  const nlohmann::json json = sila::read_json(list);
  for (const auto& item : json.at("scenes")) {
    Entry entry{item.at("name"), item.at("scene").get<std::string>(), {}};
    if (item.contains("config")) entry.config = sila::apply_json(entry.config, item.at("config"), list.string());
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::filesystem::path find_scene(const Entry& entry, const std::filesystem::path& list,
                                 const std::filesystem::path& data_dir) {
  for (const auto& folder : {list.parent_path(), data_dir}) {
    if (std::filesystem::exists(folder / entry.scene)) return folder / entry.scene;
  }
  throw std::runtime_error("scene " + entry.scene.string() + " is neither beside the list nor in the data directory");
}

void print_row(const std::string& scene, std::size_t tracks, const std::string& method, const MethodScore& row) {
  std::printf(
      "| %s | %zu | %s | %.0f | %.0f | %.3f | %.3f | **%.3f** ± %.3f | %.3f | %.3f | %.3f | %.2f | %.2f / %.2f | %.3f "
      "|\n",
      scene.c_str(), tracks, method.c_str(), row.windows.mean(), row.size.mean(), row.mhd_m.mean(),
      row.constant_mhd_m.mean(), row.ratio.mean(), row.ratio.deviation(), row.turning_ratio.mean(),
      row.mean_path_ratio.mean(), row.best_ratio.mean(), row.fallback.mean(), row.nll.mean(), row.constant_nll.mean(),
      row.seconds.mean());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::cerr << "usage: scene_table SCENES.json DATA_DIR [TRIALS] [PATH=VALUE | METHOD | SCENE]...\n";
    return 2;
  }
  const std::filesystem::path list = argv[1], data_dir = argv[2];
  const int trials = argc > 3 ? std::stoi(argv[3]) : 3;
  std::set<std::string> wanted, methods;
  std::vector<std::string> sets;
  for (int i = 4; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.find('=') != std::string::npos)
      sets.push_back(word);
    else if (word == "sila" || word == "accumulate" || word == "batch")
      methods.insert(word);
    else
      wanted.insert(word);
  }
  if (methods.empty()) methods = {"sila", "accumulate", "batch"};
  std::printf(
      "| scene | tracks | method | moving windows | size | wMHD [m] | CV [m] | wMHD / CV | turning / CV | mean path / "
      "CV | best / CV | fallback | "
      "NLL / CV | s per episode |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (Entry& entry : read_entries(list)) {
    if (!wanted.empty() && !wanted.contains(entry.name)) continue;
    for (const std::string& set : sets) entry.config = sila::set_field(entry.config, set);
    const sila::Scene scene =
        sila::read_scene(find_scene(entry, list, data_dir), entry.config.episode.scaling, data_dir);
    const std::vector<sila::PlacedTrack> tracks = placed(scene, entry.config);
    std::map<std::string, MethodScore> rows;
    for (int trial = 0; trial < trials; ++trial) {
      const sila::Split split = sila::split_tracks(tracks, kHeldBack, 100 + static_cast<std::uint64_t>(trial));
      for (const std::string& method : methods) {
        score(rows[method], run_method(method, split.train, entry.config.episode), split.test, entry.config);
      }
    }
    for (const char* method : {"sila", "accumulate", "batch"}) {
      if (rows.contains(method)) print_row(entry.name, tracks.size(), method, rows[method]);
    }
  }
  return 0;
} catch (const std::exception& error) {
  std::cerr << "scene_table: " << error.what() << "\n";
  return 1;
}
