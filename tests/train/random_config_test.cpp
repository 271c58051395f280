// Every configuration within its documented ranges is rejected before anything is learnt, or learns, fuses and
// predicts. SILA_RANDOM_CONFIG_DRAWS=2000 tries so many, SILA_RANDOM_CONFIG_SEED=7 begins with this seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sila/config.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/model_file.hpp"
#include "sila/sim/simulate.hpp"
#include "support/random_models.hpp"
#include "support/sanitized.hpp"
#include "support/sound.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// An end of the range, or a number between them, uniform in its logarithm; infinite ends count as 1e6.
double number_in(const Field& field, Random& random) {
  const double least = field.range.min, most = field.range.max;
  const double low = field.range.open_min || least == 0.0 ? 1e-4 : least, high = std::min(most, 1e6);
  const double choice = uniform(random, 0.0, 1.0);
  if (choice < 0.1) return field.range.open_min ? low : least;
  if (choice < 0.2) return field.read().is_number_float() ? most : high;
  return std::exp(uniform(random, std::log(low), std::log(high)));
}

nlohmann::json value_in(const Field& field, Random& random) {
  if (!field.choices.empty()) return std::string(field.choices[random() % field.choices.size()]);
  const nlohmann::json present = field.read();
  if (present.is_boolean()) return random() % 2 == 0;
  const double number = number_in(field, random);
  if (present.is_number_float()) return number;
  return static_cast<std::int64_t>(std::clamp(std::round(number), field.range.min, field.range.max));
}

/// A configuration of which some, half or all fields are drawn.
Config random_config(Random& random) {
  Config config;
  const double share = std::array{0.1, 0.5, 1.0}[random() % 3];
  for (const Field& field : collect_fields(config.episode))
    if (uniform(random, 0.0, 1.0) < share) field.write(value_in(field, random));
  // Of no use with metres: otherwise a third of all would be rejected.
  if (config.episode.scaling == CurbScaling::metres && random() % 8 > 0) config.episode.reference_width_m = 0.0;
  return config;
}

std::vector<FramedTrajectory> simulated_tracks(Random& random, CurbScaling scaling, int count) {
  const Simulation simulation = simulate({.tracks = count, .seed = random() % 1000, .sample_interval_s = 0.2});
  const CurbFrame& corner = primary_corner(simulation.scene).frame;
  const CurbFrame frame = rescaled(make_curb_frame(corner.origin_m, corner.axis_1, corner.axis_2, 2.5), scaling);
  return testing::framed(simulation.tracks, frame);
}

/// Predicts as `sila predict` does, from 0.4 s on.
void expect_sound_predictions(const Model& model, std::span<const FramedTrajectory> tracks,
                              const EpisodeConfig& config) {
  const Predictor predictor(model, config.predict);
  for (const FramedTrajectory& placed : tracks) {
    for (const std::size_t last : prediction_samples(placed.track, 0.4, 4.0)) {
      const CurbTrajectory observed =
          observe(placed.track, last, placed.frame, config.predict.observe_s, config.sampling);
      testing::expect_sound(predictor.predict(observed));
    }
  }
}

/// Learns a batch, fuses a second one and then a model of its own, predicts, and goes through a model file.
void expect_sound_run(const EpisodeConfig& config, Random& random) {
  const std::vector<FramedTrajectory> tracks = simulated_tracks(random, config.scaling, 15);
  const std::span all(tracks);
  Model model;
  for (const std::size_t begin : {0u, 5u}) {
    model = run_episode(model, all.subspan(begin, 5), config).model;
    testing::expect_sound(model, config);
  }
  const Model other = run_episode(Model{}, all.subspan(10), config).model;
  model = fuse_models(model, other, config.fuse, config.residual).model;
  testing::expect_sound(model, config);
  expect_sound_predictions(model, all.first(4), config);
  StoredModel stored;
  stored.model = model;
  EXPECT_TRUE(identical(model_of_bytes(model_bytes(stored)).model, model));
}

/// Whether it was not rejected. Without the budget where that is too small for what is learnt, which only learning
/// shows.
bool expect_refused_or_sound(EpisodeConfig config, Random random) {
  try {
    validate(config);
  } catch (const std::invalid_argument&) {
    EXPECT_THROW(run_episode({}, simulated_tracks(random, config.scaling, 2), config), std::invalid_argument);
    return false;
  }
  const Random same = random;
  try {
    expect_sound_run(config, random);
  } catch (const std::exception& error) {
    const bool budget_too_small = std::string(error.what()).starts_with("apply_budget: ");
    if (!budget_too_small) ADD_FAILURE() << error.what();
    config.budget = {};
    if (budget_too_small) expect_refused_or_sound(config, same);
  }
  return true;
}

std::uint64_t number_of(const char* variable, std::uint64_t otherwise) {
  const char* given = std::getenv(variable);
  return given != nullptr ? std::strtoull(given, nullptr, 10) : otherwise;
}

TEST(RandomConfig, IsRefusedAtOnceOrLearnsFusesAndPredicts) {
  const std::uint64_t first = number_of("SILA_RANDOM_CONFIG_SEED", 4);
  const std::uint64_t draws = number_of("SILA_RANDOM_CONFIG_DRAWS", testing::repeats(32));
  std::uint64_t learnt = 0;
  for (std::uint64_t seed = first; seed < first + draws; ++seed) {
    Random random(seed);
    const Config config = random_config(random);
    SCOPED_TRACE("SILA_RANDOM_CONFIG_SEED=" + std::to_string(seed) + ": " + to_json(config.episode).dump());
    if (expect_refused_or_sound(config.episode, random)) ++learnt;
    if (std::getenv("SILA_RANDOM_CONFIG_DRAWS") == nullptr && HasFailure()) return;
  }
  EXPECT_GT(4 * learnt, draws) << "most are rejected";
}

}  // namespace
}  // namespace sila
