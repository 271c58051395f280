#include "sqlite.hpp"

#include <cstring>

namespace sila::sqlite {
namespace {

/// SQLite's own busy handler retries at last ten times a second, and a reader beside a writer that commits without a
/// pause waits for very long. With 500 retries a second it reads between two commits.
int wait_for_lock(void*, int attempts) {
  constexpr int kPause_ms = 2;
  constexpr int kPatience_ms = 10000;
  if (attempts * kPause_ms >= kPatience_ms) return 0;
  sqlite3_sleep(kPause_ms);
  return 1;
}

[[noreturn]] void fail(sqlite3* database, int code) {
  const int extended = database != nullptr ? sqlite3_extended_errcode(database) : code;
  throw Error(extended, database != nullptr ? sqlite3_errmsg(database) : sqlite3_errstr(code));
}

}  // namespace

Statement::Statement(sqlite3* database, std::string_view sql) : database_(database) {
  sqlite3_stmt* statement = nullptr;
  require(sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement, nullptr));
  statement_.reset(statement);
}

void Statement::require(int code) const {
  if (code != SQLITE_OK) fail(database_, code);
}

Statement& Statement::bind(std::int64_t value) {
  require(sqlite3_bind_int64(statement_.get(), ++bound_, value));
  return *this;
}

Statement& Statement::bind(double value) {
  require(sqlite3_bind_double(statement_.get(), ++bound_, value));
  return *this;
}

Statement& Statement::bind(std::string_view text) {
  require(sqlite3_bind_text64(statement_.get(), ++bound_, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind_blob(std::string_view bytes) {
  // A null pointer would bind NULL instead of a blob without bytes.
  const void* start = bytes.empty() ? static_cast<const void*>("") : bytes.data();
  require(sqlite3_bind_blob64(statement_.get(), ++bound_, start, bytes.size(), SQLITE_TRANSIENT));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) fail(database_, code);
  sqlite3_reset(statement_.get());
  bound_ = 0;
  return false;
}

void Statement::require_type(int column, int type, const char* name) const {
  if (sqlite3_column_type(statement_.get(), column) == type) return;
  throw Error(SQLITE_MISMATCH,
              std::string("column ") + sqlite3_column_name(statement_.get(), column) + " is no " + name);
}

std::int64_t Statement::integer(int column) const {
  require_type(column, SQLITE_INTEGER, "whole number");
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const {
  require_type(column, SQLITE_FLOAT, "number");
  return sqlite3_column_double(statement_.get(), column);
}

std::string Statement::bytes(int column) const {
  const void* start = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return start == nullptr ? std::string()
                          : std::string(static_cast<const char*>(start), static_cast<std::size_t>(size));
}

std::string Statement::text(int column) const {
  require_type(column, SQLITE_TEXT, "text");
  return bytes(column);
}

std::string Statement::blob(int column) const {
  require_type(column, SQLITE_BLOB, "blob");
  return bytes(column);
}

Database::Database(const std::string& path, int flags) {
  sqlite3* database = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &database, flags, nullptr);
  database_.reset(database);
  if (code != SQLITE_OK) fail(database, code);
  sqlite3_extended_result_codes(database, 1);
  sqlite3_busy_handler(database, wait_for_lock, nullptr);
  // By default the journal is deleted without syncing its folder: after a loss of power it may exist again, and undo a
  // commit that was reported as stored.
  execute("PRAGMA synchronous = EXTRA");
}

void Database::execute(const std::string& sql) {
  const int code = sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(database_.get(), code);
}

std::int64_t Database::integer(std::string_view sql) {
  Statement statement = prepare(sql);
  if (!statement.step()) throw Error(SQLITE_CORRUPT, "a row is missing");
  return statement.integer(0);
}

std::string Database::bytes() const {
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, void (*)(void*)> content(sqlite3_serialize(database_.get(), "main", &size, 0),
                                                                sqlite3_free);
  if (!content) throw Error(SQLITE_NOMEM, "out of memory");
  return {reinterpret_cast<const char*>(content.get()), static_cast<std::size_t>(size)};
}

Database Database::of_bytes(std::string_view bytes) {
  Database database(":memory:", SQLITE_OPEN_READWRITE);
  auto* copy = static_cast<unsigned char*>(sqlite3_malloc64(bytes.size() + 1));
  if (copy == nullptr) throw Error(SQLITE_NOMEM, "out of memory");
  std::memcpy(copy, bytes.data(), bytes.size());
  const auto size = static_cast<sqlite3_int64>(bytes.size());
  // SQLite frees the copy, also when it fails.
  const int code = sqlite3_deserialize(database.database_.get(), "main", copy, size, size,
                                       SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_READONLY);
  if (code != SQLITE_OK) fail(database.database_.get(), code);
  return database;
}

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has rolled back, or will do so when the file is opened again.
  }
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace sila::sqlite
