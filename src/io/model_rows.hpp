#pragma once

#include <cstdint>
#include <string>

#include "sila/io/model_store.hpp"
#include "sqlite.hpp"

/// The rows of a model file, schema 3: what stands in which column. Nothing here opens files or begins transactions.
namespace sila::rows {

/// Makes the tables. SQLite keeps the text with its comments in the file: `sqlite3 M.sila .schema` explains the file.
extern const char* const kCreate;

/// How often the file was changed.
std::int64_t revision(sqlite::Database& database);

/// Puts the model in the place of the present one; the episodes stay.
void write_model(sqlite::Database& database, const Model& model, const std::string& configuration,
                 std::int64_t revision);
void write_episode(sqlite::Database& database, const EpisodeRecord& episode);

/// Throws: std::invalid_argument for a database that has more than plain tables. Views, triggers, generated columns and
/// indices on expressions are programs of whoever made the file, and reading would run them.
void require_plain(sqlite::Database& database);

/// Throws: sqlite::Error if the pages of the file are damaged.
void require_intact(sqlite::Database& database);

/// Throws: sqlite::Error for missing rows or columns of another type, std::invalid_argument for blobs that make no
/// model and for bytes that do not agree with their checksum.
StoredModel read(sqlite::Database& database);

}  // namespace sila::rows
