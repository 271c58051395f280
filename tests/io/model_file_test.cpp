#include <gtest/gtest.h>

#include <cmath>

#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

TEST(ModelFile, LoadsWhatItSavedBitForBit) {
  const ScratchFolder folder;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Model model = random_model(seed);
    save_model(folder / "m.sila", stored(model));
    EXPECT_TRUE(identical(load_model(folder / "m.sila").model, model));
  }
}

TEST(ModelFile, KeepsSubnormalsNegativeZeroAndExtremes) {
  const ScratchFolder folder;
  Model model = random_model(1);
  SparseGp& gp = model.transitions[0].field.gp;
  gp.response(0, 0) = -0.0;
  gp.response(0, 1) = std::numeric_limits<double>::denorm_min();
  gp.mean_response(0) = std::numeric_limits<double>::max();
  gp.mean(0) = std::numeric_limits<double>::lowest();
  model.settings.grid.origin.x() = -0.0;
  model.primitives[0].cells[0].velocity.x() = -0.0;
  model.primitives[0].weight = std::numeric_limits<double>::denorm_min();
  set_count(model.transitions[1], std::nextafter(1.0, 2.0));
  model.primitives[0].cells.front().cell.x = -1'000'000'000;
  model.primitives[0].cells.back().cell.x = 1'000'000'000;
  model.refinement.error_statistics[0].density[kWalking].components[0].along = -0.0;
  model.tracks = std::numeric_limits<long>::max();
  save_model(folder / "m.sila", stored(model));
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, model));
}

TEST(ModelFile, IdenticalTellsTheSignOfZeroAndTheLastBit) {
  const Model model = random_model(2);
  EXPECT_TRUE(identical(model, model));
  Model other = model;
  other.transitions[0].field.gp.mean(0) = std::nextafter(other.transitions[0].field.gp.mean(0), 9.0);
  EXPECT_FALSE(identical(model, other));
  Model zero = model;
  zero.refinement.error_statistics[1].stacking[0].weight = 0.0;
  Model negative = model;
  negative.refinement.error_statistics[1].stacking[0].weight = -0.0;
  EXPECT_FALSE(identical(zero, negative));
  Model fewer = model;
  fewer.primitives.pop_back();
  EXPECT_FALSE(identical(model, fewer));
}

TEST(ModelFile, KeepsAnEmptyModelAndEmptyErrorStatistics) {
  const ScratchFolder folder;
  const Model nothing;
  save_model(folder / "m.sila", {nothing, "{}", {}, "", 0});
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, nothing));
}

TEST(ModelFile, TravelsAsTheBytesOfItsFile) {
  for (const std::uint64_t seed : {3u, 14u, 15u}) {
    const StoredModel there = stored(random_model(seed));
    const std::string bytes = model_bytes(there);
    EXPECT_EQ(model_bytes(there), bytes);
    const StoredModel back = model_of_bytes(bytes);
    EXPECT_TRUE(identical(back.model, there.model)) << "seed " << seed;
    EXPECT_EQ(back.configuration, there.configuration);
    EXPECT_EQ(back.episodes.size(), there.episodes.size());
    const ScratchFolder folder;
    folder.write("m.sila", bytes);
    EXPECT_TRUE(identical(load_model(folder / "m.sila").model, there.model));
    EXPECT_THROW(model_of_bytes(std::string_view(bytes).substr(0, bytes.size() / 2)), FormatError);
  }
  EXPECT_THROW(model_of_bytes(""), FormatError);
  EXPECT_THROW(model_of_bytes("no model at all"), FormatError);
}

TEST(ModelFile, KeepsConfigurationAndEpisodesInOrder) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  EXPECT_TRUE(file.empty());
  file.commit(random_model(1), record(1), R"({"a": 1})");
  EXPECT_FALSE(file.empty());
  file.commit(random_model(2), record(2), R"({"a": 2})");
  const StoredModel read = load_model(folder / "m.sila");
  EXPECT_TRUE(identical(read.model, random_model(2)));
  EXPECT_EQ(read.configuration, R"({"a": 2})");
  ASSERT_EQ(read.episodes.size(), 2u);
  EXPECT_EQ(read.episodes[1].number, 2);
  EXPECT_EQ(read.episodes[1].tracks, 20);
  EXPECT_EQ(read.episodes[1].seconds, 0.125);
  EXPECT_EQ(read.episodes[1].size_before, 3u);
  EXPECT_EQ(read.episodes[1].size_after, 5u);
  EXPECT_EQ(read.episodes[1].statistics, R"({"note": "made up"})");
  EXPECT_FALSE(read.sila_version.empty());
  EXPECT_EQ(read.bytes, std::filesystem::file_size(folder / "m.sila"));
}

TEST(ModelFile, CommittingContinuesAFileThatWasOpenedAgain) {
  const ScratchFolder folder;
  ModelFile::open_or_create(folder / "m.sila").commit(random_model(1), record(1), "{}");
  ModelFile::open_or_create(folder / "m.sila").commit(random_model(2), record(2), "{}");
  EXPECT_EQ(load_model(folder / "m.sila").episodes.size(), 2u);
}

TEST(ModelFile, SavingReplacesModelAndEpisodes) {
  const ScratchFolder folder;
  ModelFile::open_or_create(folder / "m.sila").commit(random_model(1), record(7), "{}");
  save_model(folder / "m.sila", stored(random_model(3)));
  const StoredModel read = load_model(folder / "m.sila");
  EXPECT_TRUE(identical(read.model, random_model(3)));
  EXPECT_EQ(read.episodes.size(), 2u);
  EXPECT_EQ(read.episodes[0].number, 1);
}

TEST(ModelFile, LearningLeavesOneFileThatCanBeCopied) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  const auto files = std::distance(std::filesystem::directory_iterator(folder.path()), {});
  EXPECT_EQ(files, 1);  // no journal beside it between two episodes
  std::filesystem::copy_file(folder / "m.sila", folder / "copy.sila");
  EXPECT_TRUE(identical(load_model(folder / "copy.sila").model, random_model(1)));
}

TEST(ModelFile, OpeningAloneMakesNoFile) {
  const ScratchFolder folder;
  EXPECT_TRUE(ModelFile::open_or_create(folder / "m.sila").empty());
  EXPECT_FALSE(std::filesystem::exists(folder / "m.sila"));
}

TEST(ModelFile, RejectsAModelThatBreaksAnInvariantAndKeepsTheFile) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  Model broken = random_model(2);
  broken.transitions[0].field.gp.mean(0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(file.commit(broken, record(2), "{}"), std::invalid_argument);
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, random_model(1)));
}

TEST(ModelFile, RejectsTextsThatAreNoJsonObjectAndKeepsTheFile) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  for (const std::string text : {"", "nonsense", "[1]"}) {
    EpisodeRecord broken = record(2);
    broken.statistics = text;
    StoredModel whole = stored(random_model(2));
    whole.configuration = text;
    EXPECT_THROW(file.commit(random_model(2), record(2), text), std::invalid_argument);
    EXPECT_THROW(file.commit(random_model(2), broken, "{}"), std::invalid_argument);
    EXPECT_THROW(file.replace(whole), std::invalid_argument);
    EXPECT_THROW(model_bytes(whole), std::invalid_argument);
    EXPECT_TRUE(identical(load_model(folder / "m.sila").model, random_model(1)));
  }
}

TEST(ModelFile, RejectsAnEpisodeWithoutANumber) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  EXPECT_TRUE(
      says(message_of([&] { file.commit(random_model(1), EpisodeRecord{}, "{}"); }), "episode.number = 0, must"));
}

TEST(ModelFile, RejectsAnEpisodeTwice) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  EXPECT_TRUE(says(message_of<FormatError>([&] { file.commit(random_model(2), record(1), "{}"); }), "episode 1"));
  EXPECT_TRUE(identical(file.read().model, random_model(1)));
  commit(file, 2);  // the file can be used after an error
  EXPECT_TRUE(identical(file.read().model, random_model(2)));
}

TEST(ModelFile, DoesNotLoseTheEpisodeOfAnotherProcess) {
  const ScratchFolder folder;
  ModelFile mine = ModelFile::open_or_create(folder / "m.sila");
  ModelFile other = ModelFile::open_or_create(folder / "m.sila");
  commit(other, 1);
  EXPECT_TRUE(says(message_of<FormatError>([&] { commit(mine, 2); }), "meanwhile"));
  EXPECT_TRUE(identical(mine.read().model, random_model(1)));
  commit(mine, 2);  // after reading what the other wrote it may
  EXPECT_EQ(load_model(folder / "m.sila").episodes.size(), 2u);
}

TEST(ModelFile, TellsThatAnotherProcessChangedTheFile) {
  const ScratchFolder folder;
  ModelFile mine = ModelFile::open_or_create(folder / "m.sila");
  ModelFile other = ModelFile::open_or_create(folder / "m.sila");
  EXPECT_FALSE(mine.changed_elsewhere()) << "there is no file yet";
  commit(other, 1);
  EXPECT_FALSE(other.changed_elsewhere());
  EXPECT_TRUE(mine.changed_elsewhere());
  EXPECT_TRUE(mine.changed_elsewhere()) << "until it is read";
  EXPECT_TRUE(identical(mine.read().model, random_model(1)));
  EXPECT_FALSE(mine.changed_elsewhere());
  commit(mine, 2);
  EXPECT_FALSE(mine.changed_elsewhere());
  EXPECT_TRUE(other.changed_elsewhere());
  EXPECT_EQ(other.read().episodes.size(), 2u);
  other.rollback(1);
  EXPECT_TRUE(mine.changed_elsewhere());
  EXPECT_EQ(mine.read().episodes.size(), 1u);
}

TEST(ModelFile, TellsThatAnotherFileChangedAsOftenTookItsPlace) {
  namespace fs = std::filesystem;
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila", other = folder / "other.sila";
  for (const bool moved : {false, true}) {
    fs::remove(path);
    ModelFile mine = ModelFile::open_or_create(path);
    commit(mine, 1);
    ModelFile::open_or_create(other).commit(random_model(2), record(1), "{}");
    moved ? fs::rename(other, path) : void(fs::copy_file(other, path, fs::copy_options::overwrite_existing));
    EXPECT_THROW(mine.commit(random_model(3), record(2), "{}"), FormatError);
    EXPECT_TRUE(mine.changed_elsewhere());
    EXPECT_TRUE(identical(mine.read().model, random_model(2)));
    fs::remove(other);
  }
}

TEST(ModelFile, InspectionHasTheContractsKeysAndFitsADozenLines) {
  const ScratchFolder folder;
  const Model model = random_model(42);
  save_model(folder / "m.sila", stored(model));
  const StoredModel read = load_model(folder / "m.sila");
  const nlohmann::ordered_json json = inspect_json(read);
  EXPECT_EQ(json.at("primitives"), model.primitives.size());
  EXPECT_EQ(json.at("transitions"), model.transitions.size());
  EXPECT_EQ(json.at("size"), size(model));
  EXPECT_EQ(json.at("episodes"), 42);
  EXPECT_EQ(json.at("tracks"), 840);
  EXPECT_EQ(json.at("bytes"), std::filesystem::file_size(folder / "m.sila"));
  EXPECT_EQ(json.at("configuration").at("threshold"), 0.7);
  EXPECT_EQ(json.at("records").size(), 2u);
  ASSERT_EQ(json.at("sites").size(), 2u);
  EXPECT_EQ(json.at("sites")[1].at("share"), 0.75);
  const std::string text = describe(read);
  EXPECT_EQ(std::ranges::count(text, '\n'), 12 + static_cast<long>(model.sites.size()));
  EXPECT_TRUE(says(text, "840 tracks in 42 episodes"));
}

/// A model of episodes of 20 tracks with relative errors of .7 + 1 / sqrt(n).
StoredModel with_errors(int episodes) {
  StoredModel stored{random_model(20), "{}", {}, "", 0};
  stored.model.tracks = 20 * episodes;
  for (int i = 0; i < episodes; ++i) {
    const double ratio = i == 0 ? 0.0 : 0.7 + 1.0 / std::sqrt(20.0 * i);
    const PrequentialError error{i == 0 ? 0u : 50u, 40.0 * ratio, i == 0 ? 0.0 : 40.0};
    stored.episodes.push_back(record(i + 1));
    stored.episodes.back().statistics = nlohmann::ordered_json{{"prequential", to_json(error)}}.dump();
  }
  if (episodes > 0) stored.episodes[0].size_before = 0;
  return stored;
}

TEST(ModelFile, InspectionHasTheLearningCurveOfTheRecords) {
  const ScratchFolder folder;
  save_model(folder / "m.sila", with_errors(9));
  const StoredModel read = load_model(folder / "m.sila");
  const nlohmann::ordered_json json = inspect_json(read).at("learning_curve");
  ASSERT_EQ(json.at("points").size(), 8u);
  EXPECT_EQ(json["points"][0].at("tracks"), 20);
  EXPECT_EQ(json["points"][0].at("windows"), 50);
  EXPECT_NEAR(json.at("fit").at("asymptote"), 0.7, 1e-9);
  EXPECT_NEAR(json["fit"].at("slope"), 1.0, 1e-9);
  EXPECT_NEAR(json["fit"].at("with_more").at("ratio"), 0.7 + 1.0 / std::sqrt(270.0), 1e-9);
  EXPECT_TRUE(says(describe(read),
                   "0.775 of constant velocity after 180 tracks (fitted to 8 episodes); "
                   "with 90 more expect 0.761 (0.761 to 0.761), 1.8 % less"));
  EXPECT_TRUE(says(describe_log(read, 9), " 0.924\n"));
  EXPECT_EQ(log_json(read, 9).at("episodes")[1].at("prequential").at("windows"), 50);
}

TEST(ModelFile, InspectionHasNoLearningCurveOfFewEpisodesOrSeveralModels) {
  const auto has_curve = [](const StoredModel& stored) {
    const bool line = describe(stored).find("learning curve") != std::string::npos;
    EXPECT_EQ(line, !inspect_json(stored).at("learning_curve").at("fit").is_null());
    return line;
  };
  EXPECT_FALSE(has_curve(with_errors(0)));
  EXPECT_FALSE(has_curve(with_errors(4)));  // the first has no windows
  EXPECT_TRUE(has_curve(with_errors(5)));
  StoredModel two = with_errors(9);
  two.episodes = joined(two.episodes, with_errors(9).episodes);
  EXPECT_FALSE(has_curve(two));
  for (const char* damaged : {"", "[]", "{}", R"({"prequential": 3})", R"({"prequential": {"windows": -1}})",
                              R"({"prequential": {"windows": 9, "model_m": -1, "constant_velocity_m": 2}})",
                              R"({"prequential": {"windows": 9, "model_m": "1", "constant_velocity_m": 2}})",
                              R"({"prequential": {"windows": 9, "model_m": 1, "constant_velocity_m": 0}})"}) {
    StoredModel stored = with_errors(5);
    stored.episodes[2].statistics = damaged;
    EXPECT_FALSE(has_curve(stored)) << damaged;
  }
}

}  // namespace
}  // namespace sila
