// Predicts the detections of a tracker as they come, and learns from them in the background.
//
//   example_live_stream [corner.sila]     continues this model file, or creates it

#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <utility>
#include <vector>

#include "sila/live_stream.hpp"
#include "sila/sim/simulate.hpp"

namespace {

/// One moment of a tracker.
struct Frame {
  double t_s = 0.0;
  std::vector<sila::Detection> detections;
};

/// Stands in for a tracker: simulated people, 10 frames a second.
std::vector<Frame> frames_of_a_tracker() {
  sila::SimulationConfig place;
  place.tracks = 60;
  std::map<long, Frame> frames;
  for (const sila::Trajectory& track : sila::simulate(place).tracks) {
    for (std::size_t k = 0; k < track.times_s.size(); ++k) {
      Frame& frame = frames[std::lround(10.0 * track.times_s[k])];
      frame.t_s = track.times_s[k];
      frame.detections.push_back({track.id, track.times_s[k], track.positions_m[k]});
    }
  }
  std::vector<Frame> list;
  for (auto& [number, frame] : frames) list.push_back(std::move(frame));
  return list;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    sila::LiveStreamOptions options;
    if (count > 1) options.file = arguments[1];
    sila::LiveStream stream(std::move(options));
    std::size_t predictions = 0;
    for (const Frame& frame : frames_of_a_tracker()) {
      for (const sila::LivePrediction& made : stream.update(frame.t_s, frame.detections)) {
        const sila::Mode& best = made.prediction.modes.front();  // the heaviest
        const sila::Vector2 end_m = best.path_m.back();
        if (++predictions % 1000 == 0)
          std::printf("%s at %.1f s: %.1f s later at (%.1f, %.1f) m with weight %.2f\n", made.track.c_str(),
                      made.prediction.t0_s, made.prediction.times_s.back(), end_m.x(), end_m.y(), best.weight);
      }
      stream.wait();  // only because these frames come faster than in reality: lets learning keep up
    }
    stream.close();  // learns the last tracks
    const sila::ServiceMetrics metrics = stream.metrics();
    std::printf("%zu predictions, %ld tracks learnt\n", predictions, metrics.model_tracks);
    return metrics.learner.failed_episodes == 0 ? 0 : 1;
  } catch (const std::exception& error) {  // every error of sila
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
