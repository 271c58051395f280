#pragma once

#include <sqlite3.h>

#include <cstdint>

namespace sila {

/// While it lives SQLite writes through it: the default VFS, of which the disk may fail or lose power at a given
/// operation. Operations are what changes a disk: writing, truncating, deleting, syncing. One at a time.
class FaultyVfs {
 public:
  FaultyVfs();
  ~FaultyVfs();
  FaultyVfs(const FaultyVfs&) = delete;
  FaultyVfs& operator=(const FaultyVfs&) = delete;

  /// From this operation on (0 is the next one) all fail with this code of SQLite.
  void fail_from(int operation, int code);
  /// At this operation the power goes: it may still be done in part, and nothing works any more.
  void lose_power_at(int operation);
  /// Whether it has come to that.
  bool happened() const;
  int operations() const;
  void heal();

  /// What is on the disk after the power was lost: what was synced, and of the rest any sectors of any writes, in their
  /// order. Files are rewritten so; call it when SQLite has closed them. Constant in `seed`.
  void crash(std::uint64_t seed);
};

}  // namespace sila
