// The live core on recorded pedestrians: scores, regions that hold, memory that stays.

#include <gtest/gtest.h>

#include <map>
#include <optional>

#include "live/streams.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/live/learner.hpp"
#include "support/data.hpp"

namespace sila {
namespace {

struct Place {
  Scene scene;
  std::vector<FramedTrajectory> tracks;
};

std::optional<Place> read_place(const std::string& name, const CleanConfig& clean) {
  const auto recordings = testing::recordings();
  if (!recordings) return std::nullopt;
  Place place{read_scene(*recordings / "scenes" / (name + ".json"), CurbScaling::metres, *recordings), {}};
  for (Trajectory& track : read_scene_tracks(place.scene, clean).trajectories) {
    const CurbFrame frame = frame_for(place.scene, track, CornerChoice::primary);
    place.tracks.push_back({std::move(track), frame});
  }
  return place;
}

/// Tracks that have no common clock, one every `apart_s`, in an order of chance.
void set_apart(Place& place, double apart_s, unsigned seed) {
  std::shuffle(place.tracks.begin(), place.tracks.end(), std::mt19937(seed));
  for (std::size_t i = 0; i < place.tracks.size(); ++i) {
    for (double& t_s : place.tracks[i].track.times_s) t_s += apart_s * static_cast<double>(i);
  }
}

/// Plays the tracks, each by a tracker's detections in order of time, learns every batch and predicts each sample that
/// is due; as the service does, but without a thread, so that the result is the same each time.
struct Replayed {
  Live live;
  Model model;
};
Replayed replay(const Place& place, const LiveSettings& settings) {
  std::vector<Detection> rows;
  for (const FramedTrajectory& placed : place.tracks) {
    for (std::size_t k = 0; k < placed.track.times_s.size(); ++k)
      rows.push_back({placed.track.id, placed.track.times_s[k], placed.track.positions_m[k]});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Detection& a, const Detection& b) { return a.t_s < b.t_s; });
  Replayed run;
  run.live.keep_judged = true;
  run.model.settings.sample_interval_s = settings.episode.sampling.interval_s;
  auto snapshot = std::make_unique<Snapshot>(run.model, settings.episode.predict);
  for (const Detection& row : rows) {
    EXPECT_FALSE(hear(run.live, 1, row, 0.0, settings).refusal);
    for (const Question& question : ask(run.live, 100, settings)) {
      keep(run.live, question, calibrated(snapshot->predictor.predict(question.observed), run.live.online_calibration),
           settings);
    }
    judge_ripe(run.live, 100, settings);
    if (run.live.finished.size() < static_cast<std::size_t>(settings.live.batch)) continue;
    run.model = run_episode(run.model, std::exchange(run.live.finished, {}), settings.episode).model;
    snapshot = std::make_unique<Snapshot>(run.model, settings.episode.predict);
  }
  end_stream(run.live, 1, settings);
  return run;
}

LiveSettings settings_for(const Place& place) {
  LiveSettings settings;
  settings.frame_for = [&place](const Trajectory& track) {
    return frame_for(place.scene, track, CornerChoice::primary);
  };
  return settings;
}

TEST(LiveRealTracks, StatedRegionsHoldOverTheLastThousandPedestrians) {
  LiveSettings settings;
  std::optional<Place> there = read_place("vru_aschaffenburg", settings.clean);
  if (!there) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
  Place& place = *there;
  set_apart(place, 2.0, 1);
  settings = settings_for(place);
  settings.episode.predict.observe_s = 1.6,
  settings.episode.predict.horizon_s = 2.4;  // each track is at least 4 s long
  settings.live.every_s = 0.4;
  const Replayed run = replay(place, settings);
  EXPECT_GE(run.live.board.size(), 990u);
  const auto shares = coverage(run.live.board);
  ASSERT_EQ(shares.size(), 3u);
  for (std::size_t h = 0; h < shares.size(); ++h) {
    EXPECT_NEAR(shares[h][1], 0.5, 0.03) << "horizon " << h;
    EXPECT_NEAR(shares[h][3], 0.9, 0.03) << "horizon " << h;
    RecordProperty("in_50_" + std::to_string(h), std::to_string(shares[h][1]));
    RecordProperty("in_90_" + std::to_string(h), std::to_string(shares[h][3]));
  }
}

TEST(LiveRealTracks, LiveErrorIsWhatEvaluateGivesForTheSamePredictions) {
  LiveSettings settings;
  const std::optional<Place> there = read_place("sdd_deathCircle", settings.clean);
  if (!there) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
  const Place& place = *there;
  settings = settings_for(place);
  settings.live.every_s = settings.evaluate.stride_s;
  settings.live.batch = 100;
  settings.live.max_track_samples = 100000;
  const Replayed run = replay(place, settings);
  std::map<std::pair<std::string, double>, const WindowScore*> live;
  for (const WindowScore& score : run.live.judged) live[{score.track, score.t0_s}] = &score;
  const Evaluation evaluation = evaluate(run.model, place.tracks, settings.episode, settings.evaluate);
  std::size_t same = 0;
  for (const WindowScore& file : evaluation.windows) {
    const auto found = live.find({file.track, file.t0_s});
    ASSERT_NE(found, live.end()) << file.track << " at " << file.t0_s;
    for (std::size_t h = 0; h < file.constant.size(); ++h)
      EXPECT_NEAR(found->second->constant[h].weighted_mhd_m, file.constant[h].weighted_mhd_m, 1e-6);
    ++same;
  }
  EXPECT_EQ(same, run.live.judged.size());
  EXPECT_EQ(run.live.account.answered, run.live.account.scored + run.live.account.unscorable);
}

}  // namespace
}  // namespace sila
