#include "engine.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "service/streams.hpp"

namespace sila {
namespace {

TEST(Engine, DoesNotEndTheTracksOfAStreamWhoseLinesItIsLateToRead) {
  const ServiceSettings settings = testing::service_settings();
  const std::vector<Trajectory> tracks = testing::paths_of(testing::corner_walks(25, 3));
  const std::vector<Detection> rows = testing::stream_of(tracks, 0.0);
  LearnerThread learner(Model{}, {}, settings.episode, settings.service, {});
  std::promise<void> all_offered;
  const std::shared_future<void> wait = all_offered.get_future().share();
  // The first prediction holds the engine up until all lines are queued, far more than it reads in one turn.
  Engine engine(settings, learner, {[wait](std::vector<OutgoingLine>) { wait.wait(); }, {}}, false);
  const double arrived_s = monotonic_s() - 2.0 * ServiceConfig::silence_s;
  for (const Detection& row : rows) engine.offer({1, row, row.t_s < 1.0 ? monotonic_s() : arrived_s});
  engine.offer({1, std::nullopt, arrived_s});
  all_offered.set_value();
  engine.drain();
  Counters counters;
  for (int tries = 0; tries < 200 && counters.detections < rows.size(); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    counters = engine.metrics().counters;
  }
  EXPECT_EQ(counters.detections, rows.size());
  EXPECT_EQ(counters.tracks, tracks.size());
}

}  // namespace
}  // namespace sila
