#include "engine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "service/streams.hpp"
#include "sila/train/episode.hpp"
#include "support/learnt.hpp"

namespace sila {
namespace {

TEST(Engine, DoesNotEndTheTracksOfAStreamWhoseLinesItIsLateToRead) {
  const ServiceSettings settings = testing::service_settings();
  const std::vector<Trajectory> tracks = testing::paths_of(testing::corner_walks(25, 3));
  const std::vector<Detection> rows = testing::stream_of(tracks, 0.0);
  LearnerThread learner(Model{}, {}, settings.episode, settings.service, {});
  std::atomic<bool> held = false, all_offered = false;
  // The first prediction holds the engine up until all lines are queued, far more than it reads in one turn.
  const auto hold = [&](const std::vector<OutgoingLine>&) {
    held = true;
    held.notify_one();
    all_offered.wait(false);
  };
  Engine engine(settings, learner, {hold, {}}, false);
  const auto late = std::find_if(rows.begin(), rows.end(), [](const Detection& row) { return row.t_s > 1.0; });
  for (auto row = rows.begin(); row != late; ++row) engine.offer({1, *row, monotonic_s()});
  held.wait(false);
  const double arrived_s = monotonic_s() - 2.0 * ServiceConfig::silence_s;
  for (auto row = late; row != rows.end(); ++row) engine.offer({1, *row, arrived_s});
  engine.offer({1, std::nullopt, arrived_s});
  all_offered = true;
  all_offered.notify_one();
  engine.drain();
  Counters counters;
  testing::comes_true([&] { return (counters = engine.metrics().counters).detections >= rows.size(); });
  EXPECT_EQ(counters.detections, rows.size());
  EXPECT_EQ(counters.tracks, tracks.size());
}

TEST(Engine, OneStampAheadEndsNoOtherTrackOfAStepwiseRun) {
  const ServiceSettings settings = testing::service_settings();
  const auto tracks_after = [&](double ahead_s) {
    LearnerThread learner(Model{}, {}, settings.episode, settings.service, {});
    Engine engine(settings, learner, {[](const std::vector<OutgoingLine>&) {}, {}}, true);
    for (int k = 0; k <= 40; ++k) {
      if (k == 20) engine.offer({1, Detection{"b", 2.0 + ahead_s, {2.0, 9.0}}, monotonic_s()});
      engine.offer({1, Detection{"a", 0.1 * k, {0.1 * k, 0.0}}, monotonic_s()});
    }
    engine.offer({1, std::nullopt, monotonic_s()});
    engine.drain();
    Counters counters;
    testing::comes_true([&] { return (counters = engine.metrics().counters).tracks >= 2U; });
    return counters.tracks;
  };
  EXPECT_EQ(tracks_after(6.0), 2U);
  EXPECT_EQ(tracks_after(9.0), 2U);
}

/// The lines that an engine sends for a walk, one prediction at a time.
std::vector<std::string> lines_of(const Model& model, const OnlineCalibration& calibration) {
  const ServiceSettings settings = testing::service_settings();
  LearnerThread learner(model, calibration, settings.episode, settings.service, {});
  std::vector<std::string> lines;
  const auto keep = [&](const std::vector<OutgoingLine>& sent) {
    for (const OutgoingLine& line : sent) lines.push_back(line.text);
  };
  Engine engine(settings, learner, {keep, {}}, true);
  for (const Detection& row : testing::stream_of(testing::paths_of(testing::corner_walks(1, 4)), 0.0)) {
    engine.offer({1, row, monotonic_s()});
    engine.drain();
  }
  return lines;
}

TEST(Engine, BeginsWithTheCalibrationThatWasKept) {
  const EpisodeConfig config = testing::service_settings().episode;
  const Model model = testing::learnt(testing::corner_walks(40, 3), config);
  const std::vector<std::string> lines = lines_of(model, {});
  EXPECT_FALSE(lines.empty());
  EXPECT_EQ(lines, lines_of(model, {}));
  EXPECT_NE(lines, lines_of(model, {{1.0}, {{1.0, 1.0, 1.0, 1.0}}}));
}

}  // namespace
}  // namespace sila
