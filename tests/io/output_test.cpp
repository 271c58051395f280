#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>

#include "made_up_model.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"

namespace {

std::atomic<ino_t> last_synced;
std::string target;                // of a test
std::atomic<ino_t> target_before;  // when it was synced

}  // namespace

/// Instead of that of the C library.
extern "C" int fsync(int file) {
  struct stat status {};
  if (fstat(file, &status) == 0) last_synced = status.st_ino;
  target_before = stat(target.c_str(), &status) == 0 ? status.st_ino : 0;
  return fdatasync(file);
}

namespace sila {
namespace {

namespace fs = std::filesystem;

std::ptrdiff_t files_in(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(Output, TheTargetChangesInOneStepAtCommit) {
  const ScratchFolder folder;
  write_file(folder / "a.txt", "old");
  {
    OutputFile file(folder / "a.txt");
    file.stream() << "new" << std::flush;
    EXPECT_EQ(content_of(folder / "a.txt"), "old");
    file.commit();
  }
  EXPECT_EQ(content_of(folder / "a.txt"), "new");
  EXPECT_EQ(files_in(folder.path()), 1);
}

TEST(Output, IsOnTheDiskBeforeItReplacesTheTarget) {
  const ScratchFolder folder;
  target = folder / "a.txt";
  write_file(target, "new");
  struct stat status {};
  ASSERT_EQ(stat(target.c_str(), &status), 0);
  EXPECT_EQ(last_synced, status.st_ino);
  EXPECT_NE(target_before, status.st_ino);
}

TEST(Output, WithoutCommitNothingChangesAndNothingIsLeftBehind) {
  const ScratchFolder folder;
  write_file(folder / "a.txt", "old");
  { OutputFile(folder / "a.txt").stream() << "half"; }
  { OutputFile(folder / "b.txt").stream() << "half"; }
  EXPECT_EQ(content_of(folder / "a.txt"), "old");
  EXPECT_EQ(files_in(folder.path()), 1);
}

TEST(Output, ReplacesTheFileBehindALinkNotTheLink) {
  const ScratchFolder folder;
  write_file(folder / "a.txt", "old");
  fs::create_symlink(folder / "a.txt", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(content_of(folder / "a.txt"), "new");
}

TEST(Output, KeepsThePermissionsOfAFileItReplaces) {
  const ScratchFolder folder;
  write_file(folder / "a.txt", "old");
  fs::permissions(folder / "a.txt", fs::perms(0640));
  write_file(folder / "a.txt", "new");
  EXPECT_EQ(fs::status(folder / "a.txt").permissions(), fs::perms(0640));
}

TEST(Output, DevicesAreWrittenToAndStayDevices) {
  write_file("/dev/null", "into the void");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(Output, RejectsInOneSentenceThatNamesTheFile) {
  const ScratchFolder folder;
  const auto rejection = [](const fs::path& path) { return message_of<FormatError>([&] { write_file(path, "x"); }); };
  EXPECT_TRUE(says(rejection(folder.path()), "expected a file that can be written, found a folder"));
  EXPECT_TRUE(says(rejection(folder / "absent/a.txt"), "absent/a.txt: expected a file that can be written"));
  EXPECT_TRUE(says(rejection(""), "an empty path"));
  EXPECT_TRUE(says(rejection("/dev/full"), "disk full"));
}

}  // namespace
}  // namespace sila
