// Taking episodes back: the model, its configuration and its records are again what they were, byte for byte.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

EpisodeRecord record_of(int number) {
  EpisodeRecord record{number, 20 + number, 0.1 * number, 3, 5, {}, 1700000000 + number};
  record.statistics = R"({"note": )" + std::to_string(number) +
                      R"(, "change": {"added": [[1,2,3]], "fused": [{}, {}], )" +
                      R"("split": [], "incoming_split": 1, "gone": [0]}})";
  return record;
}

std::string configuration_of(int number) {
  return R"({"n": )" + std::to_string(number / 3) + "}";
}

void expect_same(const StoredModel& a, const StoredModel& b) {
  EXPECT_TRUE(identical(a.model, b.model));
  EXPECT_EQ(a.configuration, b.configuration);
  EXPECT_TRUE(same_records(a.episodes, b.episodes));
  EXPECT_EQ(model_bytes(a), model_bytes(b));
}

/// A small part of a model changes, as by an episode: primitives come and go, so that all others are renumbered.
Model changed(Model model, std::mt19937_64& random) {
  ++model.episodes;
  model.tracks += 20;
  model.episode_ids.push_back({random(), random()});
  std::ranges::sort(model.episode_ids);
  Refinement& refinement = model.refinement;
  const std::size_t site = random() % model.sites.size();
  ++model.sites[site].episodes;
  model.sites[site].tracks += 20;
  if (random() % 3 == 0) refinement.error_statistics[site] = random_error_statistics(random);
  if (random() % 2 == 0) model.primitives.push_back(random_primitive(random));
  const auto primitives = static_cast<int>(model.primitives.size());
  if (primitives > 4 && random() % 2 == 0) {
    const int gone = static_cast<int>(random() % static_cast<unsigned>(primitives));
    model.primitives.erase(model.primitives.begin() + gone);
    for (std::size_t i = model.transitions.size(); i-- > 0;) {
      if (model.transitions[i].from != gone && model.transitions[i].to != gone) continue;
      model.transitions.erase(model.transitions.begin() + static_cast<std::ptrdiff_t>(i));
      refinement.residuals.erase(refinement.residuals.begin() + static_cast<std::ptrdiff_t>(i));
    }
    for (Transition& edge : model.transitions) {
      edge.from -= edge.from > gone;
      edge.to -= edge.to > gone;
    }
  }
  if (model.transitions.empty()) model.transitions.push_back({0, 0, 1.0, random_field(random), {{0, 1.0, 0}}, 1});
  refinement.residuals.resize(model.transitions.size());
  const std::size_t changed = random() % model.transitions.size();
  Transition& edge = model.transitions[changed];
  set_count(edge, edge.count + 1.0);
  edge.support += 1;
  edge.sites[0].last_episode = model.sites[0].episodes;
  if (random() % 2 == 0) edge.field = random_field(random);
  if (random() % 2 == 0) refinement.residuals[changed] = random_gp(random, kResidualInputs, 6);
  return model;
}

/// A file of so many episodes, and a copy of it after each.
void learn_into(const ScratchFolder& folder, int episodes, std::uint64_t seed, int kept = kUndoKept) {
  std::mt19937_64 random(seed);
  Model model = random_model(seed);
  for (int number = 1; number <= episodes; ++number) {
    model = changed(std::move(model), random);
    ModelFile file = ModelFile::open_or_create(folder / "m.sila");
    file.commit(model, record_of(number), configuration_of(number));
    if (number == 1) file.keep_undo(kept);
    fs::copy_file(folder / "m.sila", folder / (std::to_string(number) + ".sila"));
  }
}

TEST(Undo, GivesBackWhatTheFileWasAfterEachEpisode) {
  for (const std::uint64_t seed : {100u, 201u, 302u}) {
    SCOPED_TRACE(seed);
    const ScratchFolder folder;
    learn_into(folder, 12, seed);
    for (int to = 12; to >= 1; --to) {
      SCOPED_TRACE(to);
      fs::copy_file(folder / "m.sila", folder / "back.sila", fs::copy_options::overwrite_existing);
      ModelFile::open(folder / "back.sila").rollback(to);
      expect_same(load_model(folder / "back.sila"), load_model(folder / (std::to_string(to) + ".sila")));
      EXPECT_EQ(ModelFile::open(folder / "back.sila").verify().undone, static_cast<std::size_t>(to - 1));
    }
  }
}

TEST(Undo, GoesBackInStepsAndOnFromThere) {
  const ScratchFolder folder;
  learn_into(folder, 9, 7);
  ModelFile file = ModelFile::open(folder / "m.sila");
  file.rollback(6);
  file.rollback(3);
  std::mt19937_64 random(8);
  const Model other = changed(file.read().model, random);
  file.commit(other, record_of(4), "{}");
  EXPECT_TRUE(identical(file.read().model, other));
  file.rollback(3);
  expect_same(file.read(), load_model(folder / "3.sila"));
  file.rollback(1);
  expect_same(file.read(), load_model(folder / "1.sila"));
}

TEST(Undo, ModelsThatHaveNothingInCommonAreGivenBackAsWell) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  for (int number = 1; number <= 5; ++number)
    file.commit(random_model(static_cast<std::uint64_t>(10 * number)), record_of(number), configuration_of(number));
  file.rollback(2);
  EXPECT_TRUE(identical(file.read().model, random_model(20)));
}

TEST(Undo, SaysWhichEpisodeIsTheOldestPossible) {
  const ScratchFolder folder;
  learn_into(folder, 9, 9, 3);
  ModelFile file = ModelFile::open(folder / "m.sila");
  EXPECT_EQ(file.oldest_rollback(), 6);
  const std::string bytes = content_of(folder / "m.sila");
  EXPECT_TRUE(says(message_of<FormatError>([&] { file.rollback(5); }), "keeps the models from episode 6 to 9"));
  EXPECT_TRUE(says(message_of<FormatError>([&] { file.rollback(10); }), "from episode 6 to 9"));
  EXPECT_TRUE(says(message_of<FormatError>([&] { file.rollback(-1); }), "from episode 6 to 9"));
  EXPECT_EQ(content_of(folder / "m.sila"), bytes);
  file.rollback(6);
  expect_same(file.read(), load_model(folder / "6.sila"));
  EXPECT_TRUE(says(message_of<FormatError>([&] { file.rollback(5); }), "that keeps no earlier model"));
}

TEST(Undo, NothingCanBeTakenBackOfWhatReplacedAModel) {
  const ScratchFolder folder;
  learn_into(folder, 4, 11);
  save_model(folder / "m.sila", load_model(folder / "2.sila"));
  ModelFile file = ModelFile::open(folder / "m.sila");
  EXPECT_EQ(file.oldest_rollback(), 2);
  EXPECT_THROW(file.rollback(1), FormatError);
  EXPECT_EQ(file.verify().undone, 0u);
}

TEST(Undo, ARivalsEpisodeIsRejectedAfterARollback) {
  const ScratchFolder folder;
  learn_into(folder, 3, 12);
  ModelFile learning = ModelFile::open_or_create(folder / "m.sila");
  ModelFile::open(folder / "m.sila").rollback(2);
  EXPECT_TRUE(
      says(message_of<FormatError>([&] { learning.commit(random_model(1), record_of(4), "{}"); }), "meanwhile"));
}

TEST(Undo, KeepsNoMoreThanAskedAndTheFileStopsGrowing) {
  const ScratchFolder folder;
  std::mt19937_64 random(13);
  Model model = random_model(13);
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  std::uintmax_t largest = 0;  // after the first 60
  for (int number = 1; number <= 200; ++number) {
    Model next = model;  // as large as ever, and all fields new
    for (Transition& edge : next.transitions) {
      edge.field = random_field(random);
      edge.field.gp.points = number;
    }
    file.commit(next, record(number), "{}");
    const std::uintmax_t bytes = fs::file_size(folder / "m.sila");
    if (number == 60) largest = bytes;
    if (number > 60) {
      EXPECT_LT(bytes, largest * 5 / 4) << number;
    }
  }
  EXPECT_EQ(file.verify().undone, static_cast<std::size_t>(kUndoKept));
  file.keep_undo(0);
  EXPECT_EQ(file.oldest_rollback(), 200);
  file.commit(model, record(201), "{}");
  EXPECT_EQ(file.oldest_rollback(), 201);
}

TEST(Undo, DetailsOfOldEpisodesGoAndComeBack) {
  const ScratchFolder folder;
  std::mt19937_64 random(14);
  Model model = random_model(0);
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  const int last = kDetailsKept + 5;
  StoredModel earlier;
  for (int number = 1; number <= last; ++number) {
    file.commit(model, record_of(number), "{}");
    if (number == kDetailsKept + 2) earlier = file.read();
  }
  const StoredModel now = file.read();
  for (const EpisodeRecord& episode : now.episodes) {
    SCOPED_TRACE(episode.number);
    EXPECT_EQ(says(episode.statistics, "change"), episode.number > 5);
    EXPECT_TRUE(says(episode.statistics, "note"));
  }
  file.rollback(kDetailsKept + 2);
  expect_same(file.read(), earlier);
  EXPECT_EQ(file.read().episodes[2].statistics, record_of(3).statistics);
}

TEST(Undo, TheLogTellsWhatEachEpisodeDid) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  file.commit(random_model(2), record_of(2), "{}");
  const nlohmann::ordered_json json = log_json(file.read(), file.oldest_rollback());
  EXPECT_EQ(json.at("oldest_rollback"), 1);
  ASSERT_EQ(json.at("episodes").size(), 2u);
  EXPECT_FALSE(json["episodes"][0].contains("added"));
  const nlohmann::ordered_json& second = json["episodes"][1];
  EXPECT_EQ(second.at("added"), 1);
  EXPECT_EQ(second.at("fused"), 2);
  EXPECT_EQ(second.at("split"), 1);
  EXPECT_EQ(second.at("gone"), 1);
  EXPECT_EQ(second.at("committed_s"), 1700000002);
  const std::string text = describe_log(file.read(), 1);
  EXPECT_TRUE(says(text, "2023-11-14T22:13:22Z"));
  EXPECT_TRUE(says(text, "can be rolled back to episode 1"));
}

}  // namespace
}  // namespace sila
