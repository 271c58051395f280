// The stream core on recorded pedestrians: scores and coverage.

#include <gtest/gtest.h>

#include <map>
#include <optional>

#include "service/streams.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/service/learner_thread.hpp"
#include "support/data.hpp"

namespace sila {
namespace {

struct Site {
  Scene scene;
  std::vector<FramedTrajectory> tracks;
};

std::optional<Site> read_site(const std::string& name) {
  const auto recordings = testing::recordings();
  if (!recordings) return std::nullopt;
  const Scene scene = read_scene(*recordings / "scenes" / (name + ".json"), *recordings);
  Site site{scene, without_frames(read_tracks({}, scene, {}, CleanConfig{}).trajectories)};
  place(site.tracks, scene, CornerChoice::primary, CurbScaling::metres);
  return site;
}

/// Starts the tracks `apart_s` after one another in a random order, for tracks without a common clock.
void set_apart(Site& site, double apart_s, unsigned seed) {
  std::shuffle(site.tracks.begin(), site.tracks.end(), std::mt19937(seed));
  for (std::size_t i = 0; i < site.tracks.size(); ++i) {
    for (double& t_s : site.tracks[i].track.times_s) t_s += apart_s * static_cast<double>(i);
  }
}

/// Ingests the detections of the tracks in order of time, learns every batch and makes each due prediction, as the
/// service does but without threads, so that the result is deterministic.
struct Replayed {
  StreamCore core;
  Model model;
};
Replayed replay(const Site& site, const ServiceSettings& settings) {
  Replayed run;
  run.core.keep_windows = true;
  run.model.settings.sample_interval_s = settings.episode.sampling.interval_s;
  auto snapshot = std::make_unique<Snapshot>(run.model, settings.episode.predict);
  for (const Detection& row : testing::stream_of(testing::paths_of(site.tracks), 0.0)) {
    EXPECT_FALSE(ingest(run.core, 1, row, 0.0, settings).rejection);
    for (const PredictionRequest& request : take_due_requests(run.core, 100, settings)) {
      retain(run.core, request, calibrated(snapshot->predictor.predict(request.observed), run.core.online_calibration),
             settings);
    }
    score_due(run.core, 100, settings);
    if (run.core.finished.size() < static_cast<std::size_t>(settings.service.batch)) continue;
    run.model = run_episode(run.model, std::exchange(run.core.finished, {}), settings.episode).model;
    snapshot = std::make_unique<Snapshot>(run.model, settings.episode.predict);
  }
  end_stream(run.core, 1, settings);
  return run;
}

ServiceSettings settings_for(const Site& site) {
  ServiceSettings settings;
  settings.frame_for = [&site](const Trajectory& track) {
    return frame_for(site.scene, track, CornerChoice::primary, CurbScaling::metres);
  };
  return settings;
}

TEST(ServiceRealTracks, NominalRegionsCoverTheLastThousandPedestrians) {
  std::optional<Site> read = read_site("vru_aschaffenburg");
  if (!read) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
  Site& site = *read;
  set_apart(site, 2.0, 1);
  ServiceSettings settings = settings_for(site);
  settings.episode.predict.observe_s = 1.6;
  settings.episode.predict.horizon_s = 2.4;  // each track is at least 4 s long
  settings.service.stride_s = 0.4;
  const Replayed run = replay(site, settings);
  EXPECT_GE(run.core.scores.size(), 990u);
  const auto shares = coverage(run.core.scores);
  ASSERT_EQ(shares.size(), 3u);
  for (std::size_t h = 0; h < shares.size(); ++h) {
    EXPECT_NEAR(shares[h][1], 0.5, 0.03) << "horizon " << h;
    EXPECT_NEAR(shares[h][3], 0.9, 0.03) << "horizon " << h;
  }
}

TEST(ServiceRealTracks, LiveErrorEqualsThatOfEvaluate) {
  const std::optional<Site> read = read_site("sdd_deathCircle");
  if (!read) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
  const Site& site = *read;
  ServiceSettings settings = settings_for(site);
  settings.service.stride_s = settings.evaluate.stride_s;
  settings.episode.predict.min_observe_s = settings.episode.predict.observe_s;
  settings.service.batch = 100;
  settings.service.max_track_samples = 100000;
  const Replayed run = replay(site, settings);
  std::map<std::pair<std::string, double>, const WindowScore*> live;
  for (const WindowScore& score : run.core.windows) live[{score.track, score.t0_s}] = &score;
  const Evaluation evaluation = evaluate(run.model, site.tracks, settings.episode, settings.evaluate);
  std::size_t same = 0;
  for (const WindowScore& file : evaluation.windows) {
    const auto found = live.find({file.track, file.t0_s});
    ASSERT_NE(found, live.end()) << file.track << " at " << file.t0_s;
    for (std::size_t h = 0; h < file.constant.size(); ++h)
      EXPECT_NEAR(found->second->constant[h].weighted_mhd_m, file.constant[h].weighted_mhd_m, 1e-6);
    ++same;
  }
  EXPECT_EQ(same, run.core.windows.size());
  EXPECT_EQ(run.core.counters.predictions, run.core.counters.scored + run.core.counters.unscorable);
}

}  // namespace
}  // namespace sila
