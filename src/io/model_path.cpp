#include "model_path.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>

#include "sila/core/errors.hpp"

namespace sila {

namespace fs = std::filesystem;

void reject(const fs::path& path, const std::string& found) {
  throw FormatError(path.string(), 0, "a sila model", found);
}

void reject_write(const fs::path& path, const std::string& found) {
  throw FormatError(path.string(), 0, "a model file that can be written", found);
}

void reject(const fs::path& path, const sqlite::Error& error) {
  const std::string said = std::string(" (") + error.what() + ")";
  switch (error.primary()) {
    case SQLITE_NOTADB:
      reject(path, "a file of another kind; give the path of a model that `sila learn` made");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      reject(path, "one that another process has kept locked for 10 s; try again when it is done");
    case SQLITE_CANTOPEN:
      if (!fs::exists(status_of(path)))
        reject_write(path, "that it cannot be made, or was removed while it was in use" + said);
      [[fallthrough]];
    case SQLITE_PERM:
    case SQLITE_READONLY:
      reject_write(path, "no permission for the file or its folder" + said);
    case SQLITE_FULL:
    case SQLITE_IOERR:
      reject_write(path, "that reading or writing failed; is the disk full?" + said);
    default:
      reject(path, "a damaged one; restore a copy, or learn it anew" + said);
  }
}

bool may(const fs::path& path, int what) {
  return faccessat(AT_FDCWD, path.c_str(), what, AT_EACCESS) == 0;
}

void require_regular(const fs::path& path, const fs::file_status& status) {
  if (fs::is_directory(status)) reject(path, "a folder");
  if (fs::exists(status) && !fs::is_regular_file(status)) reject(path, "something that is no regular file");
}

void require_writable(const fs::path& path, const fs::file_status& status) {
  if (path.empty()) reject_write(path, "an empty path");
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder)) reject_write(path, "that the folder " + folder.string() + " does not exist");
  if (!may(folder, W_OK | X_OK)) reject_write(path, "no permission to write in the folder " + folder.string());
  if (fs::exists(status) && !may(path, R_OK | W_OK)) reject_write(path, "no permission to read and write it");
}

fs::file_status status_of(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error);
}

}  // namespace sila
