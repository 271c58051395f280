// Learns people who walk along a sidewalk and predicts another one, with sila::core alone: no file, no JSON.
#include <cstdio>
#include <sila/core/trajectory.hpp>
#include <sila/refine/predictor.hpp>
#include <sila/train/episode.hpp>
#include <sila/version.hpp>
#include <string>
#include <vector>

namespace {

const sila::CurbFrame kCorner = sila::make_curb_frame({0.0, 0.0}, sila::Vector2::UnitX(), sila::Vector2::UnitY(), 2.0);

/// A person who walks along the x axis at 1.3 m/s, sampled at 10 Hz.
sila::FramedTrajectory walker(int number, double seconds) {
  sila::Trajectory track;
  track.id = std::to_string(number);
  for (int step = 0; step < static_cast<int>(10.0 * seconds); ++step) {
    const double walked_s = 0.1 * step;
    track.times_s.push_back(100.0 * number + walked_s);
    track.positions_m.emplace_back(1.3 * walked_s, 0.1 * (number % 5));
  }
  return {track, kCorner};
}

}  // namespace

int main() {
  std::vector<sila::FramedTrajectory> tracks;
  for (int number = 0; number < 40; ++number) tracks.push_back(walker(number, 12.0));
  const sila::EpisodeConfig config;
  const sila::Model model = run_episodes({}, tracks, 20, config, sila_update(config)).model;

  const sila::FramedTrajectory seen = walker(40, 4.0);
  const sila::CurbTrajectory observed =
      sila::observe(seen.track, seen.track.times_s.size() - 1, seen.frame, config.predict.observe_s, config.sampling);
  const sila::Prediction prediction = sila::Predictor(model, config.predict).predict(observed);
  const sila::Vector2 end_m = prediction.modes.front().path_m.back();
  std::printf("sila " SILA_VERSION ": after %.1f s at %.1f m, %.1f m: %zu modes\n", prediction.times_s.back(),
              end_m.x(), end_m.y(), prediction.modes.size());
}
