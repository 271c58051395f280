// What the model file does when something goes wrong: damaged and foreign files, killed writers, readers beside a
// writer.
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <tbb/global_control.h>

#include <array>
#include <bit>
#include <thread>

#include "io/files.hpp"
#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

using tests::run_sql;

std::string rejection_to_load(const fs::path& path) {
  return message_of<FormatError>([&] { load_model(path); });
}

std::string rejection_to_learn(const fs::path& path) {
  return message_of<FormatError>([&] { ModelFile::open_or_create(path); });
}

/// Tests of several processes. Model files are read by one thread there: a process that forks while another thread of
/// it holds a lock, as a sanitizer's of its memory, leaves a child for which nobody will ever open that lock.
class ModelFileProcesses : public testing::Test {
 private:
  tbb::global_control one_thread_{tbb::global_control::max_allowed_parallelism, 1};
};

/// Runs an action in a process of its own, which must end with exit code 0 (or by the signal, if it kills itself) and
/// ends with this one, however that ends.
template <class Action>
pid_t fork_to(Action&& action) {
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      action();
      _exit(0);
    } catch (const std::exception& error) {
      std::fputs(error.what(), stderr);
      _exit(1);
    }
  }
  return child;
}

/// How a child ended, as waitpid gives it.
int status_of(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

TEST(ModelFileDamage, NoticesAnEpisodeThatWouldBeLearntAgain) {
  const ScratchFolder folder;
  save_model(folder / "m.sila", stored(random_model(7)));
  run_sql(folder / "m.sila", "UPDATE parts SET content = x'' WHERE length(content) = 16");
  EXPECT_TRUE(says(rejection_to_load(folder / "m.sila"), "does not agree"));
}

TEST(ModelFileDamage, RejectsWhatIsNoModelAndSaysSo) {
  const ScratchFolder folder;
  EXPECT_TRUE(says(rejection_to_load(folder / "none.sila"), "none.sila: expected a sila model, found no such file"));
  EXPECT_TRUE(says(rejection_to_load(folder.path()), "found a folder"));
  EXPECT_TRUE(says(rejection_to_learn(folder.path()), "found a folder"));
  EXPECT_TRUE(says(rejection_to_load("/dev/null"), "no regular file"));
  folder.write("tracks.csv", "track_id,t,x,y\n1,0,0,0\n");
  EXPECT_TRUE(says(rejection_to_load(folder / "tracks.csv"), "another kind"));
  EXPECT_TRUE(says(rejection_to_learn(folder / "tracks.csv"), "another kind"));
  EXPECT_EQ(content_of(folder / "tracks.csv"), "track_id,t,x,y\n1,0,0,0\n");
  folder.write("empty.sila", "");
  EXPECT_TRUE(says(rejection_to_load(folder / "empty.sila"), "an empty file"));
  run_sql(folder / "foreign.db", "CREATE TABLE t (x)");
  EXPECT_TRUE(says(rejection_to_load(folder / "foreign.db"), "another program"));
  EXPECT_TRUE(says(rejection_to_learn(folder / "foreign.db"), "another program"));
}

TEST(ModelFileDamage, LearnsIntoAnEmptyFile) {
  const ScratchFolder folder;
  folder.write("m.sila", "");
  ModelFile::open_or_create(folder / "m.sila").commit(random_model(1), record(1), "{}");
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, random_model(1)));
}

TEST_F(ModelFileProcesses, RejectsUnwritablePlacesBeforeAnyLearning) {
  const ScratchFolder folder;
  EXPECT_TRUE(says(rejection_to_learn(folder / "absent/m.sila"), "absent does not exist"));
  save_model(folder / "m.sila", stored(random_model(1)));
  fs::permissions(folder / "m.sila", fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  fs::permissions(folder.path(), fs::perms(0555));
  const pid_t child = fork_to([&] {
    if (geteuid() == 0 && setuid(65534) != 0) throw std::runtime_error("cannot become an ordinary user");
    if (!identical(load_model(folder / "m.sila").model, random_model(1))) throw std::runtime_error("read badly");
    if (rejection_to_learn(folder / "m.sila").find("permission") == std::string::npos)
      throw std::runtime_error("old file");
    if (rejection_to_learn(folder / "n.sila").find("permission") == std::string::npos)
      throw std::runtime_error("new file");
  });
  EXPECT_EQ(status_of(child), 0);
  fs::permissions(folder.path(), fs::perms(0755));
}

TEST(ModelFileDamage, RejectsEveryTruncation) {
  const ScratchFolder folder;
  save_model(folder / "m.sila", stored(random_model(5)));
  const std::string whole = content_of(folder / "m.sila");
  for (std::size_t length = 1; length < whole.size(); length += length < 600 ? 37 : 1777) {
    SCOPED_TRACE(length);
    folder.write("cut.sila", whole.substr(0, length));
    EXPECT_TRUE(says(rejection_to_load(folder / "cut.sila"), "cut.sila: expected a sila model, found"));
  }
}

TEST(ModelFileDamage, RejectsEveryFlippedBitOfANumber) {
  const ScratchFolder folder;
  const Model model = random_model(6);
  save_model(folder / "m.sila", stored(model));
  std::string spoilt = content_of(folder / "m.sila");
  const auto number = std::bit_cast<std::array<char, 8>>(model.transitions[2].field.gp.mean(1));  // little endian here
  const std::size_t place = spoilt.find(std::string_view(number.data(), number.size()));
  ASSERT_NE(place, std::string::npos);
  for (std::size_t bit = 0; bit < 64; ++bit) {
    SCOPED_TRACE(bit);
    char& byte = spoilt[place + bit / 8];
    const char whole = byte;
    byte = static_cast<char>(static_cast<unsigned char>(byte) ^ (1U << (bit % 8)));
    folder.write("spoilt.sila", spoilt);
    EXPECT_TRUE(says(rejection_to_load(folder / "spoilt.sila"), "a damaged one"));
    byte = whole;
  }
}

TEST(ModelFileDamage, RejectsGarbageInPages) {
  const ScratchFolder folder;
  save_model(folder / "m.sila", stored(random_model(6)));
  const std::string whole = content_of(folder / "m.sila");
  std::mt19937_64 random(8);
  int rejected = 0;
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE(testing::Message() << "seed 8, trial " << trial);
    std::string spoilt = whole;
    const std::size_t start = random() % (whole.size() - 200);
    for (std::size_t i = start; i < start + 200; ++i) spoilt[i] = static_cast<char>(random());
    folder.write("spoilt.sila", spoilt);
    try {
      EXPECT_TRUE(identical(load_model(folder / "spoilt.sila").model, random_model(6)));
    } catch (const FormatError&) {
      ++rejected;
    }
  }
  EXPECT_GT(rejected, 0);
}

TEST(ModelFileDamage, RejectsPartsAndColumnsThatMakeNoModel) {
  const char* const spoilers[] = {
      "UPDATE parts SET content = substr(content, 1, 80) WHERE length(content) > 80",
      "UPDATE parts SET content = substr(content, 1, length(content) - 3) WHERE length(content) > 1000",
      "UPDATE parts SET content = content || zeroblob(8) WHERE rowid = 2",
      "UPDATE parts SET content = zeroblob(0) WHERE length(content) > 1000",
      "UPDATE parts SET content = 'text' WHERE rowid = 2",
      "UPDATE parts SET hash = randomblob(16) WHERE rowid = 2",
      "UPDATE parts SET content = (SELECT content FROM parts WHERE rowid = 3) WHERE rowid = 2",
      "DELETE FROM parts WHERE rowid = 2",
      "UPDATE models SET head = head || x'00'",
      "UPDATE models SET head = 'text'",
      "UPDATE models SET parts = substr(parts, 17)",
      "UPDATE models SET parts = parts || substr(parts, 1, 16)",
      "UPDATE models SET hash = zeroblob(16)",
      "UPDATE models SET episode = 7",
      "DELETE FROM models",
      "UPDATE meta SET revision = revision + 1",
      "UPDATE meta SET rollbacks = -1",
      "DELETE FROM meta",
      "DROP TABLE episodes",
      "DROP TABLE meta",
      "ALTER TABLE parts RENAME COLUMN content TO contents",
      "UPDATE episodes SET size_after = 'many'",
      "UPDATE episodes SET tracks = tracks + 1",
  };
  const ScratchFolder folder;
  save_model(folder / "m.sila", stored(random_model(9)));
  for (const char* spoiler : spoilers) {
    SCOPED_TRACE(spoiler);
    fs::copy_file(folder / "m.sila", folder / "spoilt.sila", fs::copy_options::overwrite_existing);
    run_sql(folder / "spoilt.sila", spoiler);
    EXPECT_TRUE(says(rejection_to_load(folder / "spoilt.sila"), "a damaged one"));
  }
}

TEST_F(ModelFileProcesses, AWriterKilledAtAnyTimeLeavesTheLastCompleteEpisode) {
  const ScratchFolder folder;
  std::mt19937_64 random(11);
  ModelFile::open_or_create(folder / "m.sila").commit(random_model(1), record(1), "{}");
  for (int trial = 0; trial < 15; ++trial) {
    SCOPED_TRACE(testing::Message() << "seed 11, trial " << trial);
    const int before = load_model(folder / "m.sila").episodes.back().number;
    const pid_t child = fork_to([&] {
      ModelFile file = ModelFile::open_or_create(folder / "m.sila");
      for (int number = before + 1;; ++number) commit(file, number);
    });
    while (load_model(folder / "m.sila").episodes.back().number < before + 2) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 5000));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    ASSERT_TRUE(WIFSIGNALED(status_of(child)));  // by the kill, not by an error of its own
    const StoredModel read = load_model(folder / "m.sila");
    const int last = read.episodes.back().number;
    EXPECT_EQ(read.episodes.size(), static_cast<std::size_t>(last));
    EXPECT_TRUE(identical(read.model, random_model(static_cast<std::uint64_t>(last))));
  }
}

TEST_F(ModelFileProcesses, AWriterKilledWithPagesHalfWrittenLeavesTheLastCompleteEpisode) {
  const ScratchFolder folder;
  save_model(folder / "m.sila", stored(random_model(12)));
  const std::string whole = content_of(folder / "m.sila");
  const pid_t child = fork_to([&] {
    sqlite3* database = nullptr;
    sqlite3_open((folder / "m.sila").c_str(), &database);
    const char* const half_an_episode =  // with a cache of one page SQLite writes to the file before the commit
        "PRAGMA cache_size = 1; BEGIN IMMEDIATE; UPDATE parts SET content = randomblob(9000); DELETE FROM models;";
    const int code = sqlite3_exec(database, half_an_episode, nullptr, nullptr, nullptr);
    _exit(code == SQLITE_OK ? 0 : 1);  // without closing, as a killed process
  });
  ASSERT_EQ(status_of(child), 0);
  ASSERT_TRUE(fs::exists(folder / "m.sila-journal"));
  ASSERT_NE(content_of(folder / "m.sila"), whole);  // or the test would test nothing
  EXPECT_TRUE(identical(load_model(folder / "m.sila").model, random_model(12)));
  EXPECT_EQ(content_of(folder / "m.sila"), whole);
}

TEST_F(ModelFileProcesses, OthersReadCompleteEpisodesWhileOneLearns) {
  const ScratchFolder folder;
  ModelFile writer = ModelFile::open_or_create(folder / "m.sila");
  commit(writer, 1);
  const pid_t child = fork_to([&] {
    ModelFile reader = ModelFile::open(folder / "m.sila");
    for (int seen = 0; seen < 40;) {
      const StoredModel read = reader.read();
      seen = read.episodes.back().number;
      if (!identical(read.model, random_model(static_cast<std::uint64_t>(seen))))
        throw std::runtime_error("a torn episode");
    }
  });
  for (int number = 2; number <= 40; ++number) commit(writer, number);
  EXPECT_EQ(status_of(child), 0);
}

}  // namespace
}  // namespace sila
