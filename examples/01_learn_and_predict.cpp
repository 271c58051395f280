// Learns a file of tracks in batches into a model file, opens that file, and predicts the last track.
//
//   example_learn_and_predict [tracks.csv corner.sila]     without arguments: simulated tracks, in the current folder

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "sila/config.hpp"
#include "sila/core/companions.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"

namespace {

constexpr std::size_t kBatch = 20;

/// Tracks in the frame of the place: that of the model, or for a new model one made from the first batch.
std::vector<sila::FramedTrajectory> read(const std::filesystem::path& path, const sila::Model& model,
                                         const sila::Config& config) {
  sila::ReadOptions options;
  options.camera = sila::pixel_camera(config);  // of a model in pixels; else positions are metres
  sila::CleanTracks clean = sila::read_tracks(std::span(&path, 1), {}, options, config.clean);
  for (const std::string& warning : clean.report.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  auto tracks = sila::without_frames(std::move(clean.trajectories));
  const auto first = std::span(tracks).first(std::min(kBatch, tracks.size()));
  const sila::Scene scene = sila::scene_for({}, model, first, config.corners);
  sila::place(tracks, scene, config.corners, config.episode.scaling);
  return tracks;
}

/// Continues the model file, or creates it. Batches that the model knows are not learnt again.
void learn(const std::filesystem::path& tracks_path, const std::filesystem::path& model_path) {
  sila::ModelFile file = sila::ModelFile::open_or_create(model_path);
  const sila::StoredModel stored = file.empty() ? sila::StoredModel{} : file.read();
  const sila::Config config = sila::config_of(stored);
  const std::vector<sila::FramedTrajectory> tracks = read(tracks_path, stored.model, config);
  int number = sila::last_episode(stored);
  const auto store = [&](int, const sila::Model& previous, const sila::Episode& episode) {
    file.commit(episode.model, sila::record_of(++number, previous, episode), sila::to_json(config).dump());
    std::printf("%ld tracks: %zu primitives, %zu transitions\n", episode.model.tracks, episode.model.primitives.size(),
                episode.model.transitions.size());
  };
  sila::run_episodes(stored.model, tracks, kBatch, config.episode, sila::sila_update(config.episode), store);
}

void predict(const std::filesystem::path& tracks_path, const std::filesystem::path& model_path) {
  const sila::StoredModel stored = sila::load_model(model_path);
  const sila::Config config = sila::config_of(stored);
  const sila::RefineConfig& settings = config.episode.predict;
  const std::vector<sila::FramedTrajectory> tracks = read(tracks_path, stored.model, config);
  const sila::Predictor predictor(stored.model, settings);
  const sila::PresentPeople people(tracks);  // whose companions walk along
  const auto& [track, frame] = tracks.back();
  for (const std::size_t last : sila::prediction_samples(track, settings.observe_s, 1.0)) {
    const sila::CurbTrajectory observed =
        people.observe(track, last, frame, settings.observe_s, config.episode.sampling);
    const sila::Prediction prediction = predictor.predict(observed);
    const sila::Mode& best = prediction.modes.front();  // the heaviest
    std::printf("at %.1f s: %.1f s later at (%.1f, %.1f) m with weight %.2f\n", prediction.t0_s,
                prediction.times_s.back(), best.path_m.back().x(), best.path_m.back().y(), best.weight);
  }
}

}  // namespace

int main(int count, char** arguments) {
  try {
    const std::filesystem::path tracks = count > 2 ? arguments[1] : "example_tracks.csv";
    const std::filesystem::path model = count > 2 ? arguments[2] : "example.sila";
    if (count <= 2) {
      sila::SimulationConfig place;
      place.tracks = 120;
      std::filesystem::remove(model);
      sila::write_tracks_csv(tracks, sila::simulate(place).tracks);
    }
    learn(tracks, model);
    predict(tracks, model);
    return 0;
  } catch (const std::exception& error) {  // every error of sila
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
