#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model_content.hpp"
#include "sila/io/model_file.hpp"
#include "sqlite.hpp"

/// The rows of a model file: what stands in which column. Nothing here opens files or begins transactions, and no model
/// is understood.
namespace sila::rows {

constexpr std::int64_t kApplicationId = 0x53494C41;  // "SILA"
constexpr std::int64_t kSchema = 5;

/// Makes the tables, with the number of the schema. SQLite keeps the text with its comments in the file: `sqlite3
/// M.sila .schema` explains the file.
void create(sqlite::Database& database);

/// How often the file was changed.
std::int64_t revision(sqlite::Database& database);

/// What is in the file beside the model and its episodes.
struct FileFacts {
  std::int64_t revision = 0;
  std::string sila_version;
  int undo_kept = kUndoKept;
};
FileFacts read_facts(sqlite::Database& database);

/// Throws: sqlite::Error for missing rows or columns of another type, std::invalid_argument for what does not agree
/// with its checksum.
Content read_content(sqlite::Database& database);
std::vector<EpisodeRecord> read_episodes(sqlite::Database& database);

/// Puts the content in the place of the present one. To be called last: it sums up the episodes.
void write_content(sqlite::Database& database, const Content& content, const FileFacts& facts);
void write_episode(sqlite::Database& database, const EpisodeRecord& episode);
void remove_episode(sqlite::Database& database, int number);

/// The records up to this number that may have details.
std::vector<EpisodeRecord> detailed_episodes(sqlite::Database& database, int last);

/// The steps of undo, by the number of the episode that each takes back, ascending.
std::vector<int> undo_steps(sqlite::Database& database);
/// Throws: as read_content; the sentence names the episode.
std::string read_undo(sqlite::Database& database, int episode);
void write_undo(sqlite::Database& database, int episode, const std::string& step);
void remove_undo(sqlite::Database& database, int episode);
/// Removes all steps but the last ones.
void keep_undo(sqlite::Database& database, int steps);

/// Throws: std::invalid_argument for a database that has more than plain tables. Views, triggers, generated columns and
/// indices on expressions are programs of whoever made the file, and reading would run them.
void require_plain(sqlite::Database& database);

/// Throws: sqlite::Error if the pages of the file are damaged.
void require_intact(sqlite::Database& database);
/// The same, and that every index, table and comment is as it was made; slower.
void require_all_intact(sqlite::Database& database);

}  // namespace sila::rows
