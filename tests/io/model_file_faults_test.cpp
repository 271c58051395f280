// What the model file does when the disk fails, is full, or loses power at any of the operations of an episode.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "faulty_vfs.hpp"
#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

/// The model after an episode, made once.
const Model& model_after(int episode) {
  static std::map<int, Model> made;
  const auto [entry, is_new] = made.try_emplace(episode);
  if (is_new) entry->second = random_model(static_cast<std::uint64_t>(episode));
  return entry->second;
}

void commit_episode(ModelFile& file, int number) {
  file.commit(model_after(number), record(number), "{}");
}

/// The last episode of the file, which must be whole; 0 if there is no model in it yet.
int last_whole_episode(const fs::path& path) {
  if (!fs::exists(path)) return 0;
  ModelFile file = ModelFile::open(path);
  if (file.empty()) return 0;
  const StoredModel read = file.read();
  const int last = read.episodes.back().number;
  EXPECT_EQ(read.episodes.size(), static_cast<std::size_t>(last));
  EXPECT_TRUE(identical(read.model, model_after(last)));
  return last;
}

/// A fresh file with so many episodes.
void make(const fs::path& path, int episodes) {
  const fs::path made = path.parent_path() / ("with" + std::to_string(episodes));
  if (episodes > 0 && !fs::exists(made)) {
    ModelFile file = ModelFile::open_or_create(made);
    for (int number = 1; number <= episodes; ++number) commit_episode(file, number);
  }
  fs::remove(path);
  fs::remove(path.string() + "-journal");
  if (episodes > 0) fs::copy_file(made, path);
}

/// Opens the file and learns episodes up to `until`; how many of them were said to be kept, and by whom it was
/// rejected.
struct Attempt {
  int kept = 0;
  std::string rejection;
};

Attempt learn_until(const fs::path& path, int before, int until) {
  Attempt attempt{before, ""};
  try {
    ModelFile file = ModelFile::open_or_create(path);
    for (int number = before + 1; number <= until; ++number) {
      commit_episode(file, number);
      attempt.kept = number;
    }
  } catch (const FormatError& error) {
    attempt.rejection = error.what();
  }
  return attempt;
}

class DiskThatFails : public testing::TestWithParam<int> {};

TEST_P(DiskThatFails, AtAnyOperationLeavesTheLastCompleteEpisodeAndTheNextOneIsKept) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  for (const int before : {0, 2}) {
    int operation = 0;
    for (bool happened = true; happened; ++operation) {
      SCOPED_TRACE(testing::Message() << before << " episodes, the disk fails at operation " << operation);
      make(path, before);
      FaultyVfs vfs;
      vfs.fail_from(operation, GetParam());
      const Attempt attempt = learn_until(path, before, before + 1);
      happened = vfs.happened();
      EXPECT_EQ(attempt.rejection.empty(), attempt.kept == before + 1);
      if (!attempt.rejection.empty()) {
        EXPECT_TRUE(says(attempt.rejection, "m.sila"));
        EXPECT_TRUE(says(attempt.rejection, "is the disk full?"));
      }
      vfs.heal();
      const int found = last_whole_episode(path);
      EXPECT_GE(found, attempt.kept);
      EXPECT_LE(found, before + 1);
      EXPECT_EQ(learn_until(path, found, found + 1).rejection, "");
      EXPECT_EQ(last_whole_episode(path), found + 1);
    }
    EXPECT_GT(operation, 10);
  }
}

TEST_P(DiskThatFails, ForAWhileIsForgivenByALearnerThatGoesOn) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  int operation = 0;
  for (bool happened = true; happened; ++operation) {
    SCOPED_TRACE(testing::Message() << "the disk fails at operation " << operation);
    make(path, 1);
    FaultyVfs vfs;
    ModelFile file = ModelFile::open_or_create(path);
    vfs.fail_from(operation, GetParam());
    const std::string rejection = message_of<FormatError>([&] { commit_episode(file, 2); });
    happened = vfs.happened();
    vfs.heal();
    if (!rejection.empty()) {
      EXPECT_NO_THROW(commit_episode(file, 2));
    }
    EXPECT_EQ(last_whole_episode(path), 2);
  }
  EXPECT_GT(operation, 1);  // or the disk never failed
}

INSTANTIATE_TEST_SUITE_P(ModelFileFaults, DiskThatFails, testing::Values(SQLITE_IOERR, SQLITE_FULL),
                         [](const auto& which) { return which.param == SQLITE_FULL ? "Full" : "Broken"; });

TEST(ModelFileFaults, NoLossOfPowerTakesAnEpisodeThatWasSaidToBeKept) {
  const ScratchFolder folder;
  const fs::path path = folder / "m.sila";
  for (const int before : {0, 1}) {
    int operation = 0, lost = 0, gained = 0;
    for (bool happened = true; happened; ++operation) {
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE(testing::Message() << before << " episodes, the power goes at operation " << operation << ", seed "
                                        << seed);
        make(path, before);
        Attempt attempt;
        {
          FaultyVfs vfs;
          vfs.lose_power_at(operation);
          attempt = learn_until(path, before, before + 2);
          happened = vfs.happened();
          vfs.crash(seed);
        }
        const int found = last_whole_episode(path);
        EXPECT_GE(found, attempt.kept);
        EXPECT_LE(found, std::min(attempt.kept + 1, before + 2));
        (found == before ? lost : gained) += 1;
        if (seed == 1) {
          EXPECT_EQ(learn_until(path, found, found + 1).rejection, "");
          EXPECT_EQ(last_whole_episode(path), found + 1);
        }
        if (HasFailure()) return;  // one is enough to look at
      }
    }
    EXPECT_GT(lost, 0);  // or nothing was tried
    EXPECT_GT(gained, 0);
  }
}

}  // namespace
}  // namespace sila
