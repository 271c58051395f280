#include "faulty_vfs.hpp"

#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/scratch.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSector_bytes = 512;

/// A change of a file that no sync has made lasting yet.
struct Change {
  enum Kind { write, truncate, remove } kind = write;
  std::size_t offset = 0;  ///< of a truncation the new size
  std::string bytes;
};

/// What a disk knows of a file.
struct OnDisk {
  std::optional<std::string> lasting;  ///< content that survives a loss of power; none: no such file
  std::vector<Change> pending;
};

struct Disk {
  int operations = 0;
  int fails_at = -1;
  int code = SQLITE_IOERR;
  bool happened = false;
  std::map<std::string, OnDisk> files;
};

Disk disk;
sqlite3_vfs* real_vfs = nullptr;
sqlite3_vfs faulty_vfs;

/// The code with which the next operation fails, or nothing.
std::optional<int> fault(int code_of_operation) {
  const int number = disk.operations++;
  if (disk.fails_at < 0 || number < disk.fails_at) return std::nullopt;
  disk.happened = true;
  return disk.code == SQLITE_FULL ? SQLITE_FULL : code_of_operation;
}

/// The operation at which the power goes may be done in part; those after it are not.
void note(const std::string& path, Change change) {
  const bool too_late = disk.fails_at >= 0 && disk.operations - 1 > disk.fails_at;
  if (!path.empty() && !too_late) disk.files[path].pending.push_back(std::move(change));
}

/// The disk knows a file from when SQLite first touches it.
void meet(const std::string& path) {
  if (path.empty() || disk.files.contains(path)) return;
  OnDisk& file = disk.files[path];
  if (fs::exists(path)) file.lasting = tests::content_of(path);
}

struct File {
  sqlite3_file base;
  std::string* path;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

File& file_of(sqlite3_file* file) {
  return *reinterpret_cast<File*>(file);
}
sqlite3_file* real_of(sqlite3_file* file) {
  return file_of(file).real();
}

int close(sqlite3_file* file) {
  const int code = real_of(file)->pMethods->xClose(real_of(file));
  delete file_of(file).path;
  return code;
}

int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 offset) {
  const auto broken = fault(SQLITE_IOERR_WRITE);
  note(*file_of(file).path, {Change::write, static_cast<std::size_t>(offset),
                             std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(count))});
  if (broken) return *broken;
  return real_of(file)->pMethods->xWrite(real_of(file), bytes, count, offset);
}

int truncate(sqlite3_file* file, sqlite3_int64 size) {
  const auto broken = fault(SQLITE_IOERR_TRUNCATE);
  note(*file_of(file).path, {Change::truncate, static_cast<std::size_t>(size), {}});
  if (broken) return *broken;
  return real_of(file)->pMethods->xTruncate(real_of(file), size);
}

/// What is lasting is known here; the disk below need not be waited for.
int sync(sqlite3_file* file, int) {
  if (const auto broken = fault(SQLITE_IOERR_FSYNC)) return *broken;
  const std::string& path = *file_of(file).path;
  if (!path.empty()) disk.files[path] = {tests::content_of(path), {}};
  return SQLITE_OK;
}

int read(sqlite3_file* f, void* to, int count, sqlite3_int64 offset) {
  return real_of(f)->pMethods->xRead(real_of(f), to, count, offset);
}
int size_of(sqlite3_file* f, sqlite3_int64* size) {
  return real_of(f)->pMethods->xFileSize(real_of(f), size);
}
int lock(sqlite3_file* f, int level) {
  return real_of(f)->pMethods->xLock(real_of(f), level);
}
int unlock(sqlite3_file* f, int level) {
  return real_of(f)->pMethods->xUnlock(real_of(f), level);
}
int is_reserved(sqlite3_file* f, int* out) {
  return real_of(f)->pMethods->xCheckReservedLock(real_of(f), out);
}
int control(sqlite3_file* f, int op, void* what) {
  return real_of(f)->pMethods->xFileControl(real_of(f), op, what);
}
int sector_bytes(sqlite3_file* f) {
  return real_of(f)->pMethods->xSectorSize(real_of(f));
}
int traits(sqlite3_file* f) {
  return real_of(f)->pMethods->xDeviceCharacteristics(real_of(f));
}

const sqlite3_io_methods kMethods = {1,       close,   read,        write,   truncate,     sync,   size_of,
                                     lock,    unlock,  is_reserved, control, sector_bytes, traits, nullptr,
                                     nullptr, nullptr, nullptr,     nullptr, nullptr};

int open(sqlite3_vfs*, const char* name, sqlite3_file* out, int flags, int* out_flags) {
  File& file = *new (out) File{{nullptr}, nullptr};
  const bool kept = name != nullptr && (flags & SQLITE_OPEN_DELETEONCLOSE) == 0;
  if (kept) meet(name);
  const int code = real_vfs->xOpen(real_vfs, name, file.real(), flags, out_flags);
  if (code != SQLITE_OK) return code;
  file.path = new std::string(kept ? name : "");
  file.base.pMethods = &kMethods;
  return code;
}

int remove(sqlite3_vfs*, const char* name, int sync_folder) {
  meet(name);
  const auto broken = fault(SQLITE_IOERR_DELETE);
  note(name, {Change::remove, 0, {}});
  if (broken) return *broken;
  const int code = real_vfs->xDelete(real_vfs, name, 0);
  if (code == SQLITE_OK && sync_folder != 0) disk.files[name] = {};
  return code;
}

/// Any sectors of the write.
void write_torn(std::string& content, const Change& change, std::mt19937_64& random) {
  for (std::size_t begin = 0; begin < change.bytes.size();) {
    const std::size_t in_sector = kSector_bytes - (change.offset + begin) % kSector_bytes;
    const std::size_t end = std::min(change.bytes.size(), begin + in_sector);
    if (random() % 2 == 0) {
      if (content.size() < change.offset + end) content.resize(change.offset + end, '\0');
      content.replace(change.offset + begin, end - begin, change.bytes, begin, end - begin);
    }
    begin = end;
  }
}

std::optional<std::string> after_crash(const OnDisk& file, std::mt19937_64& random) {
  std::optional<std::string> content = file.lasting;
  // A file that was made since may be there or not, a write may be there in full, in part or not at all.
  for (const Change& change : file.pending) {
    const auto part = random() % 4;
    if (part == 0) continue;
    if (change.kind == Change::remove) {
      content.reset();
      continue;
    }
    if (!content) content.emplace();
    if (change.kind == Change::truncate) content->resize(std::min(content->size(), change.offset));
    if (change.kind == Change::write && part == 1) write_torn(*content, change, random);
    if (change.kind == Change::write && part > 1) {
      content->resize(std::max(content->size(), change.offset + change.bytes.size()), '\0');
      content->replace(change.offset, change.bytes.size(), change.bytes);
    }
  }
  return content;
}

}  // namespace

FaultyVfs::FaultyVfs() {
  if (real_vfs != nullptr) throw std::logic_error("FaultyVfs: one at a time");
  disk = {};
  real_vfs = sqlite3_vfs_find(nullptr);
  faulty_vfs = *real_vfs;
  faulty_vfs.pNext = nullptr;
  faulty_vfs.zName = "faulty";
  faulty_vfs.szOsFile = static_cast<int>(sizeof(File)) + real_vfs->szOsFile;
  faulty_vfs.xOpen = open;
  faulty_vfs.xDelete = remove;
  sqlite3_vfs_register(&faulty_vfs, 1);
}

FaultyVfs::~FaultyVfs() {
  sqlite3_vfs_register(real_vfs, 1);
  sqlite3_vfs_unregister(&faulty_vfs);
  real_vfs = nullptr;
}

void FaultyVfs::fail_from(int operation, int code) {
  disk.operations = 0;
  disk.fails_at = operation;
  disk.code = code;
  disk.happened = false;
}

void FaultyVfs::lose_power_at(int operation) {
  fail_from(operation, SQLITE_IOERR);
}

bool FaultyVfs::happened() const {
  return disk.happened;
}
int FaultyVfs::operations() const {
  return disk.operations;
}
void FaultyVfs::heal() {
  disk.fails_at = -1;
}

void FaultyVfs::crash(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (const auto& [path, file] : disk.files) {
    const std::optional<std::string> content = after_crash(file, random);
    fs::remove(path);
    if (content) std::ofstream(path, std::ios::binary) << *content;
  }
  disk.files.clear();
}

}  // namespace sila
