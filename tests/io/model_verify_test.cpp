// No bit of a model file flips unnoticed; files of an older schema are rejected.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include "io/files.hpp"
#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

using tests::run_sql;

bool same(const StoredModel& a, const StoredModel& b) {
  return identical(a.model, b.model) && a.configuration == b.configuration && a.sila_version == b.sila_version &&
         same_records(a.episodes, b.episodes);
}

/// A file whose bits are flipped in place.
class Flipped {
 public:
  explicit Flipped(const fs::path& path) : bytes_(content_of(path)), file_(open(path.c_str(), O_RDWR)) {}
  ~Flipped() { close(file_); }
  Flipped(const Flipped&) = delete;
  Flipped& operator=(const Flipped&) = delete;
  std::size_t size() const { return bytes_.size(); }
  void flip(std::size_t place, unsigned bit) {
    const auto spoilt = static_cast<char>(static_cast<unsigned char>(bytes_[place]) ^ (1U << bit));
    ASSERT_EQ(pwrite(file_, &spoilt, 1, static_cast<off_t>(place)), 1);
  }
  void mend(std::size_t place) { ASSERT_EQ(pwrite(file_, &bytes_[place], 1, static_cast<off_t>(place)), 1); }

 private:
  std::string bytes_;
  int file_;
};

struct Outcome {
  int rejected = 0;  ///< could not be loaded
  int noticed = 0;   ///< could, but verify reported it
  int harmless = 0;  ///< bits that nothing depends on
};

/// Whatever is loaded is the original, and what verify passes also gives back the same earlier model.
void try_flip(const fs::path& path, const StoredModel& original, const Model& earlier, Outcome& outcome) {
  bool loaded = false;
  try {
    EXPECT_TRUE(same(load_model(path), original));
    loaded = true;
    ModelFile::open(path).verify();
    ++outcome.harmless;
  } catch (const FormatError&) {
    ++(loaded ? outcome.noticed : outcome.rejected);
    return;
  }
  if (outcome.harmless % 100 != 0) return;  // copying takes time
  const fs::path copy = path.string() + ".copy";
  fs::copy_file(path, copy, fs::copy_options::overwrite_existing);
  ModelFile file = ModelFile::open(copy);
  file.rollback(1);
  EXPECT_TRUE(identical(file.read().model, earlier));
}

Model small_model() {
  std::mt19937_64 random(4);
  Model model;
  model.primitives = {random_primitive(random)};
  model.sites = {{CurbFrame{}, 1, 20}};
  model.transitions = {{0, 0, 2.0, random_field(random), {{0, 2.0, 1}}, 2}};
  model.episodes = 1;
  model.episode_ids = {{1, 2}};
  return model;
}

TEST(Verify, NoticesAFlippedBitAnywhereInASmallFile) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  const Model first = small_model();
  Model second = first;
  set_count(second.transitions[0], 3.0);
  second.episodes = second.sites[0].episodes = 2;
  {
    ModelFile file = ModelFile::open_or_create(path);
    file.commit(first, record(1), R"({"a": 1})");
    file.commit(second, record(2), R"({"a": 2})");
  }
  const StoredModel original = load_model(path);
  Flipped file(path);
  Outcome outcome;
  const bool all = std::getenv("SILA_EVERY_BYTE") != nullptr;  // minutes; otherwise every eleventh
  for (std::size_t place = 0; place < file.size(); place += all ? 1 : 11) {
    SCOPED_TRACE(place);
    file.flip(place, static_cast<unsigned>((place * 5 + 3) % 8));
    try_flip(path, original, first, outcome);
    file.mend(place);
  }
  EXPECT_TRUE(same(load_model(path), original));
  EXPECT_GT(outcome.rejected, 100);
  EXPECT_GT(outcome.noticed, 10);
}

TEST(Verify, NoticesFlippedBitsAnywhereInALargeFile) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  {
    ModelFile file = ModelFile::open_or_create(path);
    std::mt19937_64 random(5);
    for (int number = 1; number <= 8; ++number) {
      Model model = random_model(static_cast<std::uint64_t>(50 + number % 2));
      for (int i = 0; i < 60; ++i) model.primitives.push_back(random_primitive(random));
      file.commit(model, record(number), "{}");
      if (number == 1) save_model(folder / "1.sila", {model, "{}", {record(1)}, "", 0});
    }
  }
  const StoredModel original = load_model(path);
  const Model earlier = load_model(folder / "1.sila").model;
  Flipped file(path);
  std::mt19937_64 random(6);
  Outcome outcome;
  for (int trial = 0; trial < 600; ++trial) {
    const std::size_t place = random() % file.size();
    SCOPED_TRACE(testing::Message() << "seed 6, trial " << trial << ", byte " << place);
    file.flip(place, static_cast<unsigned>(random() % 8));
    try_flip(path, original, earlier, outcome);
    file.mend(place);
  }
  EXPECT_GT(outcome.rejected, 20);
  EXPECT_GT(outcome.noticed, 200);  // most of the file is undo
}

TEST(Verify, TellsDamageToTheHistoryFromDamageToTheModel) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  for (int number = 1; number <= 4; ++number) commit(file, number);
  const auto finding = [&](const std::string& spoiler) {
    fs::copy_file(folder / "m.sila", folder / "spoilt.sila", fs::copy_options::overwrite_existing);
    run_sql(folder / "spoilt.sila", spoiler);
    return message_of<FormatError>([&] { ModelFile::open(folder / "spoilt.sila").verify(); });
  };
  EXPECT_EQ(finding("SELECT 1"), "");
  const std::string of_3_alone =
      "instr((SELECT parts FROM models WHERE episode = 3), hash) > 0 AND "
      "instr((SELECT parts FROM models WHERE episode = 4), hash) = 0";
  const std::string spoil_3 = "UPDATE models SET head = zeroblob(20) WHERE episode = 3";
  EXPECT_TRUE(says(finding(spoil_3), "the hash of the model after episode 3 does not agree"));
  EXPECT_TRUE(says(finding(spoil_3), "a sound model whose history"));
  EXPECT_TRUE(
      says(finding("UPDATE parts SET content = x'00' WHERE " + of_3_alone), "a part of the model after episode 3"));
  EXPECT_TRUE(says(finding("DELETE FROM parts WHERE " + of_3_alone), "after episode 3 is missing"));
  EXPECT_TRUE(says(finding("INSERT INTO parts VALUES (randomblob(16), x'00')"), "parts of no model"));
  EXPECT_TRUE(says(finding("UPDATE models SET episode = 30 WHERE episode = 3"), "the hash of the episodes"));
  EXPECT_TRUE(says(finding("DELETE FROM models WHERE episode = 3"), "not those of the last episodes"));
  EXPECT_TRUE(says(finding("UPDATE episodes SET tracks = 21 WHERE number = 2"), "record of episode 2"));
  EXPECT_TRUE(says(finding("DELETE FROM episodes WHERE number = 2"), "hash of the episodes"));
  EXPECT_TRUE(says(finding("UPDATE meta SET rollbacks = 21"), "hash of the episodes"));
  EXPECT_TRUE(says(finding("UPDATE parts SET content = x'00'"), "does not agree"));
  EXPECT_TRUE(says(finding("CREATE TABLE t (x)"), "not those that sila makes"));
  run_sql(folder / "m.sila", spoil_3);
  run_sql(folder / "m.sila", "DELETE FROM parts WHERE " + of_3_alone);
  ModelFile damaged = ModelFile::open(folder / "m.sila");
  EXPECT_THROW(damaged.rollback(3), FormatError);
  EXPECT_TRUE(identical(damaged.read().model, random_model(4)));  // and can be learnt on, or its history forgotten
  commit(damaged, 5);
  damaged.keep_undo(0);
  EXPECT_EQ(damaged.verify().undone, 0u);
}

TEST(Verify, AnEarlierModelOfAnotherFileIsNotTaken) {
  const ScratchFolder folder;
  for (const char* name : {"a.sila", "b.sila"}) {
    ModelFile file = ModelFile::open_or_create(folder / name);
    const std::uint64_t seed = std::string(name) == "a.sila" ? 10 : 20;
    for (int number = 1; number <= 2; ++number)
      file.commit(random_model(seed + static_cast<std::uint64_t>(number)), record(number), "{}");
  }
  const std::string attach = "ATTACH '" + (folder / "b.sila").string() + "' AS b; ";
  run_sql(folder / "a.sila", attach + "UPDATE models SET parts = (SELECT parts FROM b.models WHERE episode = 1) " +
                                 "WHERE episode = 1; INSERT OR IGNORE INTO parts SELECT * FROM b.parts;");
  EXPECT_TRUE(says(message_of<FormatError>([&] { ModelFile::open(folder / "a.sila").verify(); }), "after episode 1"));
  EXPECT_THROW(ModelFile::open(folder / "a.sila").rollback(1), FormatError);
}

TEST(Verify, AnEpisodeMendsDamagedPartsThatItsModelHas) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  run_sql(folder / "m.sila", "UPDATE parts SET content = x'00'");
  EXPECT_THROW(load_model(folder / "m.sila"), FormatError);
  file.commit(random_model(1), record(2), "{}");
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, random_model(1)));
  EXPECT_EQ(file.verify().undone, 1u);
}

TEST(OtherSchema, IsRejectedWithWhatHelps) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  save_model(path, stored(random_model(1)));
  for (const int schema : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 1000}) {
    run_sql(path, "PRAGMA user_version = " + std::to_string(schema));
    const std::string bytes = content_of(path), number = "schema " + std::to_string(schema) + " of ";
    const std::string rejection = message_of<FormatError>([&] { load_model(path); });
    EXPECT_TRUE(says(rejection, number + (schema < 14 ? "an older" : "a newer") + " sila (this one writes 14)"));
    EXPECT_TRUE(
        says(rejection, schema > 14 ? "update sila" : "learn the model anew by `sila learn TRACKS --model NEW.sila`"));
    EXPECT_THROW(ModelFile::open_or_create(path), FormatError);
    EXPECT_THROW(save_model(path, stored(random_model(2))), FormatError);
    EXPECT_EQ(content_of(path), bytes);
  }
}

}  // namespace
}  // namespace sila
