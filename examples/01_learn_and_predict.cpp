// Learns a simulated intersection in batches and predicts one pedestrian.

#include <cstdio>

#include "sila/refine/predictor.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"

int main() {
  sila::SimulationConfig place;
  place.tracks = 120;
  const sila::Simulation simulated = sila::simulate(place);
  std::vector<sila::FramedTrajectory> tracks;
  for (const sila::Trajectory& track : simulated.tracks)
    tracks.push_back({track, sila::primary_corner(simulated.scene).frame});

  const sila::EpisodeConfig config;
  sila::Model model;
  for (std::size_t from = 0; from + 20 <= tracks.size() - 20; from += 20) {
    const sila::Episode episode = sila::run_episode(model, std::span(tracks).subspan(from, 20), config);
    model = episode.model;
    std::printf("%ld tracks: %zu primitives, %zu transitions\n", model.tracks, model.primitives.size(),
                model.transitions.size());
  }

  // A pedestrian the model has not seen, 3.2 s after they came into view.
  const sila::FramedTrajectory& unseen = tracks.back();
  const auto due = sila::prediction_samples(unseen.track, config.predict.observe_s, 1.0);
  if (due.empty()) return 1;
  const sila::CurbTrajectory observed = sila::PresentPeople(tracks).observe(unseen.track, due.front(), unseen.frame,
                                                                            config.predict.observe_s, config.sampling);
  const sila::Prediction prediction = sila::Predictor(model, config.predict).predict(observed);
  for (const sila::Mode& mode : prediction.modes) {
    std::printf("%.2f: in 5 s at (%.1f, %.1f) m\n", mode.weight, mode.path_m.back().x(), mode.path_m.back().y());
  }
  return 0;
}
