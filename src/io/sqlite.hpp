#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace sila::sqlite {

/// An error of SQLite, with its extended result code.
class Error : public std::runtime_error {
 public:
  Error(int code_, const std::string& message) : std::runtime_error(message), code(code_) {}
  int primary() const { return code & 0xff; }
  int code;
};

/// A prepared statement; values are bound and columns read in order of their 0-based place.
class Statement {
 public:
  Statement(sqlite3* database, std::string_view sql);

  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view text);
  Statement& bind_blob(std::string_view bytes);

  /// The next row; false after the last. After the last the statement can be bound anew.
  bool step();

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  std::string blob(int column) const;

 private:
  void require(int code) const;
  std::string bytes(int column) const;
  void require_type(int column, int type, const char* name) const;

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement_{nullptr, sqlite3_finalize};
  int bound_ = 0;
};

class Database {
 public:
  Database(const std::string& path, int flags);
  void execute(const std::string& sql);
  Statement prepare(std::string_view sql) { return {database_.get(), sql}; }
  /// The result of a statement with one row of one number.
  std::int64_t integer(std::string_view sql);

  /// The bytes that a file with this content has, and a database that has the content of such bytes.
  std::string bytes() const;
  static Database of_bytes(std::string_view bytes);

 private:
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> database_{nullptr, sqlite3_close_v2};
};

/// A transaction that is rolled back unless committed.
class Transaction {
 public:
  Transaction(Database& database, const std::string& begin) : database_(database) { database_.execute(begin); }
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace sila::sqlite
