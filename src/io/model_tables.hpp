#pragma once

#include "model/model_parts.hpp"
#include "sila/io/model_file.hpp"
#include "sqlite.hpp"

/// The tables of a model file. Whatever is read is compared with its hash: SQLite has no checksums of its own.
/// Functions that read throw sqlite::Error for missing rows or columns of another type, std::invalid_argument for
/// content that has another hash.
namespace sila::tables {

constexpr std::int64_t kApplicationId = 0x53494C41;  // "SILA"
constexpr std::int64_t kSchema = 14;

/// Makes the tables, with the number of the schema. SQLite keeps the text with its comments in the file: `sqlite3
/// M.sila .schema` explains the file.
void create(sqlite::Database& database);

struct Meta {
  std::int64_t revision = 0;  ///< how often the file was changed
  std::string sila_version;
  int rollbacks = kUndoKept;  ///< how many episodes can be taken back at most
};
/// Tells one content of a file from another, also from that of another file that was changed as often.
struct Revision {
  std::int64_t number = 0;  ///< of Meta; 0: the file is empty
  std::string hash;         ///< of the row of meta
  bool operator==(const Revision&) const = default;
};
Revision revision(sqlite::Database& database);
Meta read_meta(sqlite::Database& database);
/// To be called last in a transaction: the hash in this row covers the episodes and the last model.
void write_meta(sqlite::Database& database, const Meta& meta);

/// Those of a condition in SQL, or all, by number.
std::vector<EpisodeRecord> read_episodes(sqlite::Database& database, const std::string& condition = "TRUE");
/// In the place of one with the same number.
void write_episode(sqlite::Database& database, const EpisodeRecord& episode);

/// The numbers of the episodes whose models are kept, ascending; the last is the present model.
std::vector<int> kept_models(sqlite::Database& database);
ModelContent read_model(sqlite::Database& database, int episode);
/// Writes the parts that are not there already, and mends those that are there and damaged.
void write_model(sqlite::Database& database, int episode, const ModelParts& parts);
/// Removes all models but the last ones, and the parts of no other.
void keep_models(sqlite::Database& database, std::int64_t models);
/// Removes the records and models after an episode.
void remove_after(sqlite::Database& database, int episode);
/// The hashes of parts that no model names: none in a sound file.
std::vector<std::string> unnamed_parts(sqlite::Database& database);

/// Throws: std::invalid_argument for a database that has more than plain tables. Views, triggers, generated columns and
/// indices on expressions are programs that reading would run.
void require_plain(sqlite::Database& database);

/// Throws: sqlite::Error if the pages of the file are damaged.
void require_intact(sqlite::Database& database);
/// The same, and that every index, table and comment is as it was made; slower.
void require_all_intact(sqlite::Database& database);

}  // namespace sila::tables
