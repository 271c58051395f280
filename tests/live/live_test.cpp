#include "sila/live/live.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "live/streams.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/evaluate/split.hpp"

namespace sila {
namespace {

using testing::answer_all;
using testing::corner_walks;
using testing::delayed;
using testing::live_settings;
using testing::paths_of;
using testing::stream_of;

/// Positions of tracks without their ids, in an order of their own.
std::multiset<std::vector<double>> shapes_of(const std::vector<Trajectory>& tracks) {
  std::multiset<std::vector<double>> shapes;
  for (const Trajectory& track : tracks) {
    std::vector<double> shape = track.times_s;
    for (const Vector2& p : track.positions_m) shape.push_back(p.x()), shape.push_back(p.y());
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

std::uint64_t queued(const Live& live) {
  std::uint64_t waiting = 0;
  for (const auto& [id, stream] : live.streams) {
    for (const auto& [track, person] : stream.people) waiting += person.waiting ? 1 : 0;
  }
  return waiting;
}

TEST(Turns, StreamsTakeTurnsAndWhoWaitsLongestIsFirst) {
  Turns turns;
  for (const char* track : {"a", "b", "c"}) turns.push(1, track);
  turns.push(7, "d");
  turns.push(3, "e");
  std::string order;
  while (!turns.empty()) {
    const auto [stream, track] = turns.pop();
    order += std::to_string(stream) + track + " ";
    if (track == "d") turns.push(7, "f");
  }
  EXPECT_EQ(order, "1a 3e 7d 1b 7f 1c ");
  EXPECT_EQ(turns.size(), 0u);
}

TEST(Live, LateDetectionsInAnyOrderMakeTheTracksThatAFileWouldMake) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const LiveSettings settings = live_settings();
    const std::vector<Detection> rows = spoiled(stream_of(paths_of(corner_walks(8, seed)), 1.3), seed);
    Live live;
    for (const Detection& row : delayed(rows, 0.99 * settings.live.late_s, seed)) {
      EXPECT_FALSE(hear(live, 1, row, 0.0, settings).refusal) << "seed " << seed << " t " << row.t_s;
      answer_all(live, settings);
    }
    end_stream(live, 1, settings);
    EXPECT_EQ(shapes_of(paths_of(live.finished)), shapes_of(cleaned(rows, settings.clean))) << "seed " << seed;
    EXPECT_TRUE(live.streams.empty());
  }
}

TEST(Live, PredictsAtTheSamplesAtWhichAFileIsPredicted) {
  for (const double every_s : {0.5, 1.0, 1.6}) {
    LiveSettings settings = live_settings();
    settings.live.every_s = every_s;
    const std::vector<Detection> rows = stream_of(paths_of(corner_walks(6, 3)), 0.7);
    std::multiset<std::pair<std::string, double>> live_at, file_at;
    Live live;
    for (const Detection& row : rows) {
      hear(live, 1, row, 0.0, settings);
      for (const Question& question : ask(live, 10, settings))
        live_at.emplace(question.track, question.observed.times_s.back());
    }
    for (const Trajectory& track : cleaned(rows, settings.clean)) {
      for (const std::size_t last : prediction_samples(track, settings.episode.predict.observe_s, every_s))
        file_at.emplace(track.id, track.times_s[last]);
    }
    EXPECT_EQ(live_at, file_at);
    EXPECT_FALSE(file_at.empty());
  }
}

TEST(Live, ScoresAreThoseOfEvaluateForTheSamePredictions) {
  LiveSettings settings = live_settings();
  settings.live.every_s = settings.evaluate.stride_s;
  const std::vector<Detection> rows = spoiled(stream_of(paths_of(corner_walks(20, 7)), 1.1), 7);
  Live live;
  live.keep_judged = true;
  std::map<std::pair<std::string, double>, Prediction> sent;
  for (const Detection& row : rows) {
    hear(live, 1, row, 0.0, settings);
    for (const Question& question : ask(live, 10, settings)) {
      const Prediction prediction =
          calibrated(testing::standing_prediction(question.observed, settings.episode), live.online_calibration);
      sent[{question.track, prediction.t0_s}] = prediction;
      keep(live, question, prediction, settings);
    }
    judge_ripe(live, 10, settings);
  }
  end_stream(live, 1, settings);
  std::map<std::pair<std::string, double>, WindowScore> of_live;
  for (const WindowScore& score : live.judged) of_live[{person_of(score.track), score.t0_s}] = score;
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
    const auto found = of_live.find({person_of(file.track), file.t0_s});
    if (found == of_live.end()) continue;
    ++compared;
    for (std::size_t h = 0; h < file.model.size(); ++h) {
      EXPECT_NEAR(found->second.model[h].weighted_mhd_m, file.model[h].weighted_mhd_m, 1e-9);
      EXPECT_NEAR(found->second.constant[h].weighted_mhd_m, file.constant[h].weighted_mhd_m, 1e-9);
      EXPECT_EQ(found->second.model[h].coverage, file.model[h].coverage);
    }
  }
  EXPECT_GT(compared, 20u);
  EXPECT_EQ(compared, live.judged.size());
}

TEST(Live, NothingThatAStreamSendsThrowsOrGrowsBeyondTheLimits) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    LiveSettings settings = live_settings();
    settings.live.max_ids = 12, settings.live.max_track_samples = 100, settings.live.max_unscored = 50;
    settings.live.remembered = 10;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    Live live;
    double now_s = 0.0;
    std::uint64_t taken = 0, refused = 0;
    for (int i = 0; i < 4000; ++i) {
      now_s += 0.05 * uniform(random);
      const double fate = uniform(random);
      if (fate < 0.002) now_s += 1e4 * (uniform(random) - 0.5);
      double t_s = now_s - (fate > 0.8 ? uniform(random) : 0.0);
      if (fate > 0.995) t_s = std::pow(10.0, 400.0 * (uniform(random) - 0.5));
      const double x = fate > 0.98 ? 1e9 * (uniform(random) - 0.5) : now_s + uniform(random);
      const Detection row{std::to_string(static_cast<int>(20.0 * uniform(random))), t_s, {x, fate > 0.99 ? NAN : 1.0}};
      const Heard heard = hear(live, 1 + static_cast<StreamId>(fate > 0.5), row, 0.0, settings);
      ++(heard.refusal ? refused : taken);
      if (uniform(random) < 0.3) answer_all(live, settings);
      std::uint64_t unscored = 0;
      for (const auto& [id, stream] : live.streams) {
        EXPECT_LE(stream.people.size(), 12u);
        for (const auto& [track, person] : stream.people) {
          EXPECT_LE(person.track.rows.size(), 100u);
          unscored += person.unscored.size();
        }
      }
      EXPECT_EQ(unscored, live.account.waiting_for_future);
      EXPECT_LE(unscored, 50u);
      EXPECT_LE(live.board.size(), 10u);
      live.finished.clear();
    }
    const Account& account = live.account;
    EXPECT_EQ(account.taken, taken);
    EXPECT_EQ(account.taken, account.early + account.answered + account.superseded + queued(live)) << "seed " << seed;
    EXPECT_GT(refused, 0u);
    end_stream(live, 1, settings), end_stream(live, 2, settings);
    EXPECT_EQ(account.answered, account.scored + account.unscorable + account.unscored);
    EXPECT_EQ(account.waiting_for_future, 0u);
  }
}

TEST(Live, ANewerDetectionTakesThePlaceOfAPredictionThatStillWaits) {
  const LiveSettings settings = live_settings();
  Live live;
  int superseded = 0;
  for (int k = 0; k < 50; ++k)
    superseded += hear(live, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, k, settings).superseded ? 1 : 0;
  EXPECT_EQ(superseded, 50 - 32 - 1);
  const std::vector<Question> questions = ask(live, 10, settings);
  ASSERT_EQ(questions.size(), 1u);
  EXPECT_DOUBLE_EQ(questions.front().observed.times_s.back(), 4.9);
  EXPECT_EQ(questions.front().arrived_s, 49.0);
}

TEST(Live, WhoWaitsLongestIsAskedFirst) {
  const LiveSettings settings = live_settings();
  Live live;
  for (int k = 0; k < 40; ++k) {
    for (const char* id : {"a", "b", "c"}) hear(live, 1, {id, 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings);
    if (k < 39) {
      EXPECT_LE(ask(live, 1, settings).size(), 1u);
    }
  }
  std::set<std::string> rest;
  for (const Question& question : ask(live, 10, settings)) rest.insert(question.track);
  EXPECT_EQ(rest.size(), 3u);
}

TEST(Live, StreamsDoNotShareIdsOrClocks) {
  const LiveSettings settings = live_settings();
  Live live;
  for (int k = 0; k < 20; ++k) {
    EXPECT_FALSE(hear(live, 1, {"a", 0.1 * k, {0.1 * k, 0.0}}, 0.0, settings).refusal);
    EXPECT_FALSE(hear(live, 2, {"a", 1e6 - 0.1 * k * 0.0 + 0.1 * k, {50.0, 0.1 * k}}, 0.0, settings).refusal);
  }
  end_stream(live, 1, settings);
  ASSERT_EQ(live.finished.size(), 1u);
  EXPECT_EQ(live.finished.front().track.times_s.size(), 20u);
  EXPECT_EQ(live.streams.size(), 1u);
}

}  // namespace
}  // namespace sila
