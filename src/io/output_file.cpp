#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
  return std::generic_category().message(error);
}

[[noreturn]] void reject_output(const fs::path& path, const std::string& found) {
  throw FormatError(path.string(), 0, "a file that can be written", found);
}

/// Creates a file that did not exist before, with the permissions that the user's umask gives a new file.
fs::path create_beside(const fs::path& replaced, const fs::path& target) {
  for (int attempt = 0;; ++attempt) {
    fs::path candidate = replaced;
    candidate += "." + std::to_string(getpid()) + "-" + std::to_string(attempt) + ".part";
    const int file = open(candidate.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (file >= 0) {
      close(file);
      return candidate;
    }
    if (errno == EEXIST && attempt < 1000) continue;
    const fs::path folder = replaced.has_parent_path() ? replaced.parent_path() : fs::path(".");
    reject_output(target, "that a file cannot be made in the folder " + folder.string() + " (" + reason(errno) + ")");
  }
}

/// Writes a file through to the disk: a rename may reach it before the content does. 0 or the error.
int synced(const fs::path& path) {
  const int file = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  const int error = file < 0 || fsync(file) != 0 ? errno : 0;
  if (file >= 0) close(file);
  return error;
}

}  // namespace

OutputFile::OutputFile(const fs::path& path) : target_(path) {
  if (path.empty()) reject_output("''", "an empty path");
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) reject_output(path, "a folder");
  if (fs::exists(status) && access(path.c_str(), W_OK) != 0) reject_output(path, reason(errno));
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    written_ = path;
  } else {
    // Through symbolic links, or the link would be replaced and the file behind it stay as it was.
    replaced_ = fs::exists(status) ? fs::canonical(path) : path;
    written_ = create_beside(replaced_, target_);
    if (fs::exists(status)) fs::permissions(written_, status.permissions(), error);
  }
  stream_.open(written_, std::ios::binary);
  if (!stream_) {
    const int cause = errno;
    if (!replaced_.empty()) fs::remove(written_, error);
    reject_output(path, reason(cause));
  }
}

OutputFile::~OutputFile() {
  if (replaced_.empty() || written_.empty()) return;
  stream_.close();
  std::error_code ignored;
  fs::remove(written_, ignored);
}

void OutputFile::commit() {
  stream_.close();
  if (!stream_) reject_output(target_, "that not everything could be written; is the disk full?");
  if (replaced_.empty()) return;
  std::error_code error(synced(written_), std::generic_category());
  if (!error) fs::rename(written_, replaced_, error);
  if (error) reject_output(target_, error.message());
  written_.clear();
}

void write_file(const fs::path& path, std::string_view content) {
  OutputFile file(path);
  file.stream() << content;
  file.commit();
}

}  // namespace sila
