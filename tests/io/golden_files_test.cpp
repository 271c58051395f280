// Files of each released format, as the sila that released it wrote them: every later version reads them and predicts
// the same. Those of the present format are made anew, for a meant change of predictions, by
//   SILA_WRITE_GOLDEN=1 build/release/tests/test_io --gtest_filter='GoldenFiles.*'
// A new schema adds files of its own; those of a schema that is no longer read stay, to be rejected.
#include <gtest/gtest.h>

#include <cstdlib>

#include "sila/io/files.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

const std::filesystem::path kGolden = std::filesystem::path(SILA_TESTS_DIR) / "golden";

/// Small: horizon, pseudo-inputs.
EpisodeConfig small_config() {
  EpisodeConfig config;
  config.predict.horizon_s = 0.4;
  config.residual.max_pseudo_inputs = 2;
  config.learn.field.gp.max_pseudo_inputs = config.fuse.gp.max_fused_pseudo_inputs = 4;
  return config;
}

std::vector<FramedTrajectory> simulated_tracks() {
  const Simulation simulation = simulate({.tracks = 8});
  return testing::framed(simulation.tracks, primary_corner(simulation.scene).frame);
}

StoredModel learnt(const EpisodeConfig& config) {
  StoredModel stored;
  const auto record = [&](int number, const Model& previous, const Episode& episode) {
    stored.episodes.push_back(record_of(number, previous, episode));
  };
  stored.model = run_episodes({}, simulated_tracks(), 4, config, sila_update(config), record).model;
  return stored;
}

/// The first of each track after 2 s.
RecordedPredictions predictions_of(const Model& model, const EpisodeConfig& config) {
  const Predictor predictor(model, config.predict);
  RecordedPredictions predictions;
  for (const FramedTrajectory& placed : simulated_tracks()) {
    const std::vector<std::size_t> samples = prediction_samples(placed.track, 2.0, 60.0);
    if (samples.empty()) continue;
    Prediction prediction = predictor.predict(
        observe(placed.track, samples.front(), placed.frame, config.predict.observe_s, config.sampling));
    predictions[{placed.track.id, prediction.t0_s}] = std::move(prediction);
  }
  return predictions;
}

void write_golden() {
  const StoredModel stored = learnt(small_config());
  std::filesystem::remove(kGolden / "schema_14.sila");
  save_model(kGolden / "schema_14.sila", stored);
  std::string v1, rounded;
  for (const auto& [key, prediction] : predictions_of(stored.model, small_config())) {
    v1 += prediction_line(key.first, prediction, nullptr, nullptr, {.v1 = true}) + "\n";
    rounded += prediction_line(key.first, prediction) + "\n";
  }
  write_file(kGolden / "lines_v1.ndjson", v1);
  write_file(kGolden / "lines.ndjson", rounded);
}

/// `absolute` beside `relative` * |a|: of positions and covariances [m, m²] and all else.
void expect_same(const RecordedPredictions& a, const RecordedPredictions& b, double absolute, double relative) {
  const auto near = [&](double x, double y) { EXPECT_NEAR(x, y, absolute + relative * std::abs(x)); };
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [key, first] : a) {
    SCOPED_TRACE("track " + key.first);
    ASSERT_TRUE(b.contains(key));
    const Prediction& second = b.at(key);
    EXPECT_EQ(first.fallback, second.fallback);
    near(first.novelty, second.novelty);
    ASSERT_EQ(first.times_s.size(), second.times_s.size());
    ASSERT_EQ(first.modes.size(), second.modes.size());
    for (std::size_t m = 0; m < first.modes.size(); ++m) {
      near(first.modes[m].weight, second.modes[m].weight);
      for (std::size_t j = 0; j < first.times_s.size(); ++j) {
        for (const int i : {0, 1}) near(first.modes[m].path_m[j][i], second.modes[m].path_m[j][i]);
        for (const int i : {0, 1, 3})
          near(first.modes[m].covariances_m2[j](i % 2, i / 2), second.modes[m].covariances_m2[j](i % 2, i / 2));
      }
    }
    ASSERT_EQ(first.regions.size(), second.regions.size());
    for (std::size_t r = 0; r < first.regions.size(); ++r) {
      for (std::size_t j = 0; j < first.times_s.size(); ++j)
        near(first.regions[r].levels[j], second.regions[r].levels[j]);
    }
  }
}

TEST(GoldenFiles, ModelOfSchema14PredictsAsItDid) {
  if (std::getenv("SILA_WRITE_GOLDEN") != nullptr) write_golden();
  const tests::ScratchFolder folder;  // reading needs write permission where a writer was killed
  std::filesystem::copy_file(kGolden / "schema_14.sila", folder / "m.sila");
  ModelFile file = ModelFile::open(folder / "m.sila");
  EXPECT_EQ(file.verify().episodes, 2u);
  const StoredModel stored = file.read();
  EXPECT_EQ(stored.model.tracks, 8);
  // Other processors and compilers round differently.
  expect_same(read_predictions(kGolden / "lines_v1.ndjson"), predictions_of(stored.model, small_config()), 1e-9, 1e-9);
}

TEST(GoldenFiles, ModelOfSchema14CanBeLearntOn) {
  const Model model = load_model(kGolden / "schema_14.sila").model;
  std::vector<FramedTrajectory> more = simulated_tracks();
  more.resize(6);
  EXPECT_EQ(run_episode(model, more, small_config()).model.episodes, 3);
}

TEST(GoldenFiles, AnOlderSchemaIsRejectedWithWhatToDo) {
  const tests::ScratchFolder folder;
  std::filesystem::copy_file(kGolden / "schema_13.sila", folder / "m.sila");
  const std::string message = message_of<std::exception>([&] { load_model(folder / "m.sila"); });
  EXPECT_TRUE(says(message, "schema 13"));
  EXPECT_TRUE(says(message, "sila learn TRACKS --model NEW.sila"));
}

TEST(GoldenFiles, BothFormsOfLinesGiveTheSamePredictions) {
  const RecordedPredictions exact = read_predictions(kGolden / "lines_v1.ndjson");
  EXPECT_GE(exact.size(), 5u);
  expect_same(exact, read_predictions(kGolden / "lines.ndjson"), 0.001, 0.02);
}

}  // namespace
}  // namespace sila
