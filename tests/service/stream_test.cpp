#include "sila/service/stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "service/open_track.hpp"
#include "service/streams.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/training_support.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

using testing::answer_all;
using testing::corner_walks;
using testing::delayed;
using testing::paths_of;
using testing::service_settings;
using testing::stream_of;

/// Positions of tracks without their ids, in an order of their own.
std::multiset<std::vector<double>> shapes_of(const std::vector<Trajectory>& tracks) {
  std::multiset<std::vector<double>> shapes;
  for (const Trajectory& track : tracks) {
    std::vector<double> shape = track.times_s;
    for (const Vector2& p : track.positions_m) shape.insert(shape.end(), {p.x(), p.y()});
    shapes.insert(shape);
  }
  return shapes;
}

std::vector<Trajectory> cleaned(const std::vector<Detection>& rows, const CleanConfig& config) {
  const Detections source{"file", rows, rows.size()};
  return clean(std::span(&source, 1), config).trajectories;
}

/// Repeats, contradictions, outliers, gaps and ids that are used again, as trackers make them.
std::vector<Detection> spoiled(std::vector<Detection> rows, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Detection> result;
  for (Detection& row : rows) {
    const double fate = uniform(random);
    if (fate < 0.03) continue;
    result.push_back(row);
    if (fate < 0.05) result.push_back(row);
    if (fate > 0.97) result.back().position_m += Vector2(40.0, 0.0);
    if (fate > 0.99) result.push_back(row);
  }
  std::erase_if(result, [](const Detection& row) { return row.track == "w3" && row.t_s > 8.0 && row.t_s < 11.0; });
  for (Detection& row : result) {
    if (row.track == "w5" && row.t_s > 12.0) row.position_m += Vector2(0.0, 30.0);
  }
  return result;
}

std::uint64_t queued(const StreamCore& core) {
  std::uint64_t waiting = 0;
  for (const auto& [id, stream] : core.streams) {
    for (const auto& [track, pedestrian] : stream.pedestrians) waiting += pedestrian.queued ? 1 : 0;
  }
  return waiting;
}

TEST(StreamCore, StreamsTakeTurns) {
  const ServiceSettings settings = service_settings();
  StreamCore core;
  for (int k = 0; k <= 33; ++k) {
    for (const StreamId stream : std::vector<StreamId>{1, 3, 7}) {
      for (const char* id : {"a", "b"}) ingest(core, stream, {id, 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings);
    }
  }
  EXPECT_EQ(due_predictions(core), 6u);
  std::string order;
  for (const PredictionRequest& request : take_due_requests(core, 4, settings))
    order += std::to_string(request.stream) + request.track + " ";
  for (const PredictionRequest& request : take_due_requests(core, 4, settings))
    order += std::to_string(request.stream) + request.track + " ";
  EXPECT_EQ(order, "1a 3a 7a 1b 3b 7b ");
  EXPECT_EQ(due_predictions(core), 0u);
}

TEST(StreamCore, LateDetectionsGiveTheTracksOfAFile) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const ServiceSettings settings = service_settings();
    const std::vector<Detection> rows = spoiled(stream_of(paths_of(corner_walks(8, seed)), 1.3), seed);
    StreamCore core;
    for (const Detection& row : delayed(rows, 0.99 * settings.service.late_s, seed)) {
      EXPECT_FALSE(ingest(core, 1, row, 0.0, settings).rejection) << "seed " << seed << " t " << row.t_s;
      answer_all(core, settings);
    }
    end_stream(core, 1, settings);
    EXPECT_EQ(shapes_of(paths_of(core.finished)), shapes_of(cleaned(rows, settings.clean))) << "seed " << seed;
    EXPECT_TRUE(core.streams.empty());
  }
}

TEST(StreamCore, TakesImagePointsThroughACamera) {
  ServiceSettings settings = service_settings();
  settings.camera = flat_camera(0.02);
  StreamCore core;
  for (int k = 0; k <= 20; ++k) ingest(core, 1, {"a", 0.1 * k, {5.0 * k, -50.0}}, 0.0, settings);
  EXPECT_EQ(ingest(core, 1, {"b", 2.0, {std::nan(""), 0.0}}, 0.0, settings).rejection, Rejection::not_usable);
  end_stream(core, 1, settings);
  ASSERT_EQ(core.finished.size(), 1U);
  EXPECT_TRUE(core.finished[0].track.positions_m.back().isApprox(Vector2(2.0, 1.0)));
}

TEST(StreamCore, SeesTheCompanionsThatAFileShows) {
  const ServiceSettings settings = service_settings();
  std::vector<FramedTrajectory> tracks = {{{"a", {}, {}, 0}, {}}, {{"b", {}, {}, 0}, {}}, {{"c", {}, {}, 0}, {}}};
  const Vector2 starts_m[] = {{0, 0}, {0, 0.8}, {0, 30}}, velocities_mps[] = {{1.2, 0}, {1.1, 0.2}, {1.2, 0}};
  StreamCore core;
  std::size_t with_companions = 0;
  for (int k = 0; k <= 40; ++k) {
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      Trajectory& track = tracks[i].track;
      track.times_s.push_back(0.1 * k);
      track.positions_m.push_back(starts_m[i] + 0.1 * k * velocities_mps[i]);
      ingest(core, 1, {track.id, track.times_s.back(), track.positions_m.back()}, 0.0, settings);
    }
    for (const PredictionRequest& request : take_due_requests(core, 10, settings)) {
      const auto own = std::ranges::find(tracks, request.track, [](const auto& placed) { return placed.track.id; });
      const Vector2 expected_mps = PresentPeople(tracks).companions_mps(own->track, own->track.times_s.size() - 1);
      EXPECT_LT((request.observed.companions_mps - expected_mps).norm(), 1e-6);
      if (expected_mps.norm() > 0.05) ++with_companions;
    }
  }
  EXPECT_GE(with_companions, 4U);
}

TEST(StreamCore, PredictsAtTheSamplesOfAFile) {
  for (const double stride_s : {0.5, 1.0, 1.6}) {
    ServiceSettings settings = service_settings();
    settings.service.stride_s = stride_s;
    const std::vector<Detection> rows = stream_of(paths_of(corner_walks(6, 3)), 0.7);
    std::multiset<std::pair<std::string, double>> live_at, file_at;
    StreamCore core;
    for (const Detection& row : rows) {
      ingest(core, 1, row, 0.0, settings);
      for (const PredictionRequest& request : take_due_requests(core, 10, settings))
        live_at.emplace(request.track, request.observed.times_s.back());
    }
    for (const Trajectory& track : cleaned(rows, settings.clean)) {
      for (const std::size_t last : prediction_samples(track, settings.episode.predict.min_observe_s, stride_s))
        file_at.emplace(track.id, track.times_s[last]);
    }
    EXPECT_EQ(live_at, file_at);
    EXPECT_FALSE(file_at.empty());
  }
}

TEST(StreamCore, ScoresEqualThoseOfEvaluate) {
  ServiceSettings settings = service_settings();
  settings.service.stride_s = settings.evaluate.stride_s;
  settings.episode.predict.min_observe_s = settings.episode.predict.observe_s;
  const std::vector<Detection> rows = spoiled(stream_of(paths_of(corner_walks(20, 7)), 1.1), 7);
  StreamCore core;
  core.keep_windows = true;
  std::map<std::pair<std::string, double>, Prediction> sent;
  for (const Detection& row : rows) {
    ingest(core, 1, row, 0.0, settings);
    for (const PredictionRequest& request : take_due_requests(core, 10, settings)) {
      const Prediction prediction =
          calibrated(testing::standing_prediction(request.observed, settings.episode), core.online_calibration);
      sent[{request.track, prediction.t0_s}] = prediction;
      retain(core, request, prediction, settings);
    }
    score_due(core, 10, settings);
  }
  end_stream(core, 1, settings);
  std::map<std::pair<std::string, double>, WindowScore> of_stream;
  for (const WindowScore& score : core.windows) of_stream[{person_of(score.track), score.t0_s}] = score;
  std::vector<FramedTrajectory> tracks;
  for (const Trajectory& track : cleaned(rows, settings.clean)) tracks.push_back({track, settings.frame_for(track)});
  std::size_t compared = 0;
  const Evaluation evaluation = evaluate_forecast(
      [&](const CurbTrajectory& observed) {
        const auto found = sent.find({person_of(observed.id), observed.times_s.back()});
        return found != sent.end() ? found->second : testing::standing_prediction(observed, settings.episode);
      },
      tracks, settings.episode, settings.evaluate);
  for (const WindowScore& file : evaluation.windows) {
    const auto found = of_stream.find({person_of(file.track), file.t0_s});
    if (found == of_stream.end()) continue;
    ++compared;
    for (std::size_t h = 0; h < file.model.size(); ++h) {
      EXPECT_NEAR(found->second.model[h].weighted_mhd_m, file.model[h].weighted_mhd_m, 1e-9);
      EXPECT_NEAR(found->second.constant[h].weighted_mhd_m, file.constant[h].weighted_mhd_m, 1e-9);
      EXPECT_EQ(found->second.model[h].coverage, file.model[h].coverage);
    }
  }
  EXPECT_GT(compared, 20u);
  EXPECT_EQ(compared, core.windows.size());
}

TEST(StreamCore, NoInputThrowsOrExceedsTheLimits) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ServiceSettings settings = service_settings();
    settings.service.max_ids = 12;
    settings.service.max_track_samples = 100;
    settings.service.max_pending_scores = 50;
    settings.service.scored_pedestrians = 10;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    StreamCore core;
    double now_s = 0.0;
    std::uint64_t accepted = 0, rejected = 0;
    for (int i = 0; i < 4000; ++i) {
      now_s += 0.05 * uniform(random);
      const double fate = uniform(random);
      if (fate < 0.002) now_s += 1e4 * (uniform(random) - 0.5);
      double t_s = now_s - (fate > 0.8 ? uniform(random) : 0.0);
      if (fate > 0.995) t_s = std::pow(10.0, 400.0 * (uniform(random) - 0.5));
      const double x = fate > 0.98 ? 1e9 * (uniform(random) - 0.5) : now_s + uniform(random);
      const Detection row{std::to_string(static_cast<int>(20.0 * uniform(random))), t_s, {x, fate > 0.99 ? NAN : 1.0}};
      const IngestResult result = ingest(core, 1 + static_cast<StreamId>(fate > 0.5), row, 0.0, settings);
      ++(result.rejection ? rejected : accepted);
      if (uniform(random) < 0.3) answer_all(core, settings);
      std::uint64_t pending = 0;
      for (const auto& [id, stream] : core.streams) {
        EXPECT_LE(stream.pedestrians.size(), 12u);
        for (const auto& [track, pedestrian] : stream.pedestrians) {
          EXPECT_LE(pedestrian.track.rows.size(), 100u);
          pending += pedestrian.pending.size();
        }
      }
      EXPECT_EQ(pending, core.counters.pending_scores);
      EXPECT_LE(pending, 50u);
      EXPECT_LE(core.scores.size(), 10u);
      core.finished.clear();
    }
    const Counters& counters = core.counters;
    EXPECT_EQ(counters.detections, accepted);
    EXPECT_EQ(counters.detections, counters.not_due + counters.predictions + counters.superseded + queued(core))
        << "seed " << seed;
    EXPECT_GT(rejected, 0u);
    end_stream(core, 1, settings);
    end_stream(core, 2, settings);
    EXPECT_EQ(counters.predictions, counters.scored + counters.unscorable + counters.not_retained);
    EXPECT_EQ(counters.pending_scores, 0u);
  }
}

TEST(StreamCore, ANewerDetectionSupersedesADuePrediction) {
  const ServiceSettings settings = service_settings();
  StreamCore core;
  std::uint64_t superseded = 0;
  for (int k = 0; k < 50; ++k) superseded += ingest(core, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, k, settings).superseded;
  EXPECT_EQ(superseded, 50U - 4U - 1U);
  EXPECT_EQ(core.counters.superseded, 50U - 4U - 1U);
  const std::vector<PredictionRequest> requests = take_due_requests(core, 10, settings);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_DOUBLE_EQ(requests.front().observed.times_s.back(), 4.9);
  EXPECT_EQ(requests.front().arrived_s, 49.0);
  ingest(core, 1, {"a", 5.0, {5.0, 0.0}}, 50, settings);
  end_stream(core, 1, settings);
  EXPECT_EQ(core.counters.superseded, 50U - 4U) << "one was due when the track ended";
  for (int k = 0; k <= 4; ++k) ingest(core, 2, {"a", 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings);
  superseded = 0;
  for (int k = 0; k < settings.service.clock_patience; ++k)
    superseded += ingest(core, 2, {"b", 1000.0 + 0.1 * k, {0.0, 0.0}}, 0.0, settings).superseded;
  EXPECT_EQ(superseded, 1U) << "one was due when the clock was reset";
}

TEST(StreamCore, PredictsNoSampleTwiceWhenARowContradictsTheLast) {
  for (const double stride_s : {0.0, 0.3}) {
    ServiceSettings settings = service_settings();
    settings.service.stride_s = stride_s;
    StreamCore core;
    std::vector<double> times_s, expected_s;
    for (int k = 0; k <= 20; ++k) {
      ingest(core, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings);
      if (k == 10) ingest(core, 1, {"a", 0.1 * k, {0.1 * k, 9.0}}, 0.0, settings);
      for (const PredictionRequest& request : take_due_requests(core, 10, settings))
        times_s.push_back(request.observed.times_s.back());
    }
    end_stream(core, 1, settings);
    ASSERT_EQ(core.finished.size(), 1U);
    const Trajectory& path = core.finished.front().track;
    for (const std::size_t i : prediction_samples(path, settings.episode.predict.min_observe_s, stride_s))
      expected_s.push_back(path.times_s[i]);
    EXPECT_EQ(times_s, expected_s) << "stride_s " << stride_s;
  }
}

TEST(StreamCore, WarnsOnceIfAnIdIsNotThatOfOnePerson) {
  const auto expect_one = [](double step_s, const char* text) {
    StreamCore core;
    for (int k = 0; k < 12000; ++k)
      ingest(core, 1, {"-1", step_s * (k / 2), {0.0, step_s == 0.0 || k % 2 == 0 ? 0.0 : 9.0}}, 0.0,
             service_settings());
    ASSERT_EQ(core.warnings.size(), 1u);
    EXPECT_TRUE(says(core.warnings[0], text));
  };
  expect_one(0.05, "give each person an id of their own");
  expect_one(0.0, "an id is not that of one person");  // the clock of the tracker stands still
}

TEST(StreamCore, TheLongestWaitingPredictionIsMadeFirst) {
  const ServiceSettings settings = service_settings();
  StreamCore core;
  std::string order;
  for (int k = 0; k < 10; ++k) {
    for (const char* id : {"a", "b", "c"}) ingest(core, 1, {id, 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings);
    for (const PredictionRequest& request : take_due_requests(core, 1, settings)) order += request.track;
  }
  EXPECT_EQ(order, "abcabc") << "all three are due at each detection from 0.4 s on";
}

TEST(StreamCore, StreamsDoNotShareIdsOrClocks) {
  const ServiceSettings settings = service_settings();
  StreamCore core;
  for (int k = 0; k < 20; ++k) {
    EXPECT_FALSE(ingest(core, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings).rejection);
    EXPECT_FALSE(ingest(core, 2, {"a", 1e6 + 0.1 * k, {50.0, 0.1 * k}}, 0.0, settings).rejection);
  }
  end_stream(core, 1, settings);
  ASSERT_EQ(core.finished.size(), 1u);
  EXPECT_EQ(core.finished.front().track.times_s.size(), 20u);
  EXPECT_EQ(core.streams.size(), 1u);
}

TEST(OpenTrack, IsCutAtTheGapsThatCutAFile) {
  for (const double interval_s : {0.1, 1.0}) {
    for (const double gap_s : {0.9, 1.015, 1.04, 1.15, 1.3}) {
      OpenTrack track;
      double t_s = 0.0;
      for (int i = 0; i < 10; ++i) {
        extend(track, {"a", t_s, Vector2(t_s, 0.0)}, {});
        t_s += i == 4 ? gap_s : interval_s;
      }
      EXPECT_EQ(track.path.times_s, trajectories_of(track, {}).back().times_s) << interval_s << ' ' << gap_s;
    }
  }
}

TEST(StreamCore, OneStampAheadEndsNoOtherTrack) {
  const ServiceSettings settings = service_settings();
  for (const double ahead_s : {1.0, 3.0, 9.0}) {
    StreamCore core;
    for (int k = 0; k <= 60; ++k) {
      if (k == 20) {
        EXPECT_FALSE(ingest(core, 1, {"b", 2.0 + ahead_s, {2.0, 9.0}}, 0.0, settings).rejection);
      }
      EXPECT_FALSE(ingest(core, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings).rejection);
    }
    EXPECT_EQ(core.streams.at(1).pedestrians.at("a").track.path.times_s.size(), 61U) << ahead_s;
  }
}

TEST(StreamCore, WarnsWhereNoTrackCanBePredicted) {
  const ServiceSettings settings = service_settings();
  struct Case {
    double interval_s;
    int rows_of_id;
    const char* warning;
  };
  for (const auto& [interval_s, rows_of_id, warning] :
       {Case{2.0, 20, "Send seconds"}, Case{0.2, 1, "no prediction was due"}, Case{0.2, 20, nullptr}}) {
    StreamCore core;
    for (int k = 0; core.counters.tracks < 20; ++k)
      ingest(core, 1, {std::to_string(k / rows_of_id), interval_s * k, {interval_s * (k % 20), 0.0}}, 0.0, settings);
    ASSERT_EQ(core.warnings.size(), warning == nullptr ? 0U : 1U);
    EXPECT_TRUE(warning == nullptr || says(core.warnings[0], warning)) << core.warnings[0];
  }
}

TEST(StreamCore, WarnsOnceOfOneIdForAllPeople) {
  const ServiceSettings settings = service_settings();
  for (const bool one_id : {true, false}) {
    StreamCore core;
    for (int k = 0; k < 600; ++k) {
      const int person = k % 3;
      ingest(core, 1, {one_id ? "0" : std::to_string(person), 0.1 * (k / 3), {0.0, 5.0 * person}}, 0.0, settings);
    }
    ASSERT_EQ(core.warnings.size(), one_id ? 1U : 0U);
    EXPECT_TRUE(!one_id || says(core.warnings[0], "100 of 150 detections")) << core.warnings[0];
  }
}

TEST(StreamCore, WaitsForATrackAsLongAsItsJitterAllows) {
  ServiceSettings settings = service_settings();
  settings.service.late_s = 0.1;
  StreamCore core;
  for (int k = 0; k < 10; ++k) {
    if (k == 5) ingest(core, 1, {"b", 5.15, Vector2(0.0, 9.0)}, 0.0, settings);  // 1.15 s after the last row of a
    ingest(core, 1, {"a", k < 5 ? k : k + 0.18, Vector2(k, 0.0)}, 0.0, settings);
  }
  EXPECT_EQ(core.streams.at(1).pedestrians.at("a").track.path.times_s.size(), 10U);
}

}  // namespace
}  // namespace sila
