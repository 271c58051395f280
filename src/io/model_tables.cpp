#include "model_tables.hpp"

#include <optional>
#include <unordered_set>

#include "core/bytes.hpp"
#include "core/concatenate.hpp"
#include "model/hash.hpp"

namespace sila::tables {
namespace {

using bytes::count_of;

const char* const kTables = R"(
CREATE TABLE meta (              -- one row
  revision INTEGER NOT NULL,     -- how often the file was changed
  sila_version TEXT NOT NULL,    -- of the last writer
  rollbacks INTEGER NOT NULL,    -- how many episodes can be taken back at most
  hash BLOB NOT NULL             -- of the rest of this row, the hashes of all episodes and that of the last model
);
CREATE TABLE episodes (
  number INTEGER PRIMARY KEY,    -- 1, 2, 3, ...
  tracks INTEGER NOT NULL,
  seconds REAL NOT NULL,         -- that learning it took
  size_before INTEGER NOT NULL,
  size_after INTEGER NOT NULL,
  committed_s INTEGER NOT NULL,  -- when: seconds since 1970, UTC; 0: not known
  hash BLOB NOT NULL,            -- of the rest of the row
  statistics TEXT NOT NULL       -- JSON
);
CREATE TABLE models (            -- the last one, and those before it that a rollback gives back
  episode INTEGER PRIMARY KEY,   -- that left the model; 0: a model without records
  hash BLOB NOT NULL,            -- of the rest of the row
  head BLOB NOT NULL,            -- its counts: src/model/model_parts.cpp, as for the content of parts
  parts BLOB NOT NULL            -- the hashes of its parts, in order
);
CREATE TABLE parts (             -- what models consist of, each once
  hash BLOB PRIMARY KEY,         -- of the content; every hash is a MurmurHash3 of 128 bits
  content BLOB NOT NULL
);
)";

constexpr std::size_t kHashBytes = 16;

std::string hash_bytes(const std::string& content) {
  std::string bytes;
  for (const std::uint64_t half : hash_of(content)) bytes::append(bytes, half);
  return bytes;
}

std::string hash_of_record(const EpisodeRecord& episode) {
  std::string bytes;
  bytes::append(bytes, std::int64_t{episode.number});
  bytes::append(bytes, std::int64_t{episode.tracks});
  bytes::append(bytes, episode.seconds + 0.0);  // + 0.0: SQLite knows no -0
  bytes::append(bytes, static_cast<std::int64_t>(episode.size_before));
  bytes::append(bytes, static_cast<std::int64_t>(episode.size_after));
  bytes::append(bytes, episode.committed_s);
  return hash_bytes(bytes + episode.statistics);
}

std::string hash_of_model(int episode, const std::string& head, const std::string& hashes) {
  std::string bytes;
  bytes::append(bytes, std::int64_t{episode});
  bytes::append_text(bytes, head);
  return hash_bytes(bytes + hashes);
}

std::string hash_of_meta(sqlite::Database& database, const Meta& meta) {
  std::string bytes;
  bytes::append(bytes, meta.revision);
  bytes::append(bytes, std::int64_t{meta.rollbacks});
  bytes::append_text(bytes, meta.sila_version);
  sqlite::Statement last = database.prepare("SELECT hash FROM models ORDER BY episode DESC LIMIT 1");
  if (last.step()) bytes += last.blob(0);
  sqlite::Statement episode = database.prepare("SELECT hash FROM episodes ORDER BY number");
  while (episode.step()) bytes += episode.blob(0);
  return hash_bytes(bytes);
}

/// The content of the part that has a hash; null if there is none.
std::optional<std::string> find_part(sqlite::Statement& select, std::string_view hash) {
  if (!select.bind_blob(hash).step()) return std::nullopt;
  std::string content = select.blob(0);
  while (select.step()) continue;
  return content;
}
const char* const kSelectPart = "SELECT content FROM parts WHERE hash = ?";

void require_intact(sqlite::Database& database, const std::string& check) {
  sqlite::Statement findings = database.prepare("PRAGMA " + check + "(1)");
  const std::string finding = findings.step() ? findings.text(0) : "no answer to " + check;
  if (finding != "ok") throw sqlite::Error(SQLITE_CORRUPT, finding);
}

void remove_unnamed_parts(sqlite::Database& database) {
  sqlite::Statement remove = database.prepare("DELETE FROM parts WHERE hash = ?");
  for (const std::string& hash : unnamed_parts(database)) remove.bind_blob(hash).step();
}

}  // namespace

void create(sqlite::Database& database) {
  database.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                   "; PRAGMA user_version = " + std::to_string(kSchema) + ";" + kTables);
}

Revision revision(sqlite::Database& database) {
  sqlite::Statement row = database.prepare("SELECT revision, hash FROM meta");
  if (!row.step()) throw sqlite::Error(SQLITE_CORRUPT, "meta has no row");
  return {row.integer(0), row.blob(1)};
}

Meta read_meta(sqlite::Database& database) {
  sqlite::Statement row = database.prepare("SELECT revision, sila_version, rollbacks, hash FROM meta");
  if (!row.step()) throw sqlite::Error(SQLITE_CORRUPT, "meta has no row");
  const Meta meta{row.integer(0), row.text(1), count_of<int>(row.integer(2))};
  if (row.blob(3) != hash_of_meta(database, meta))
    throw std::invalid_argument("the hash of the episodes does not agree");
  return meta;
}

void write_meta(sqlite::Database& database, const Meta& meta) {
  database.execute("DELETE FROM meta");
  sqlite::Statement insert = database.prepare("INSERT INTO meta VALUES (?, ?, ?, ?)");
  insert.bind(meta.revision).bind(std::string_view(meta.sila_version)).bind(std::int64_t{meta.rollbacks});
  insert.bind_blob(hash_of_meta(database, meta)).step();
}

std::vector<EpisodeRecord> read_episodes(sqlite::Database& database, const std::string& condition) {
  std::vector<EpisodeRecord> episodes;
  sqlite::Statement row = database.prepare(
      "SELECT number, tracks, seconds, size_before, size_after, statistics, committed_s, hash FROM episodes WHERE " +
      condition + " ORDER BY number");
  while (row.step()) {
    episodes.push_back({count_of<int>(row.integer(0)), count_of<long>(row.integer(1)), row.real(2),
                        count_of<std::size_t>(row.integer(3)), count_of<std::size_t>(row.integer(4)), row.text(5),
                        row.integer(6)});
    if (row.blob(7) != hash_of_record(episodes.back()))
      throw invalid_argument("the hash of the record of episode ", episodes.back().number, " does not agree");
  }
  return episodes;
}

void write_episode(sqlite::Database& database, const EpisodeRecord& episode) {
  sqlite::Statement insert = database.prepare("INSERT OR REPLACE INTO episodes VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(std::int64_t{episode.number}).bind(std::int64_t{episode.tracks}).bind(episode.seconds);
  insert.bind(static_cast<std::int64_t>(episode.size_before)).bind(static_cast<std::int64_t>(episode.size_after));
  insert.bind(episode.committed_s).bind_blob(hash_of_record(episode)).bind(std::string_view(episode.statistics)).step();
}

std::vector<int> kept_models(sqlite::Database& database) {
  std::vector<int> numbers;
  sqlite::Statement row = database.prepare("SELECT episode FROM models ORDER BY episode");
  while (row.step()) numbers.push_back(count_of<int>(row.integer(0)));
  return numbers;
}

ModelContent read_model(sqlite::Database& database, int episode) {
  const std::string name = "the model after episode " + std::to_string(episode);
  sqlite::Statement row = database.prepare("SELECT hash, head, parts FROM models WHERE episode = ?");
  if (!row.bind(std::int64_t{episode}).step()) throw std::invalid_argument(name + " is missing");
  ModelParts parts{row.blob(1), {}};
  const std::string hashes = row.blob(2);
  if (row.blob(0) != hash_of_model(episode, parts.head, hashes))
    throw std::invalid_argument("the hash of " + name + " does not agree");
  sqlite::Statement select = database.prepare(kSelectPart);
  for (std::size_t at = 0; at < hashes.size(); at += kHashBytes) {
    const std::string_view hash = std::string_view(hashes).substr(at, kHashBytes);
    std::optional<std::string> part = find_part(select, hash);
    if (!part) throw std::invalid_argument("a part of " + name + " is missing");
    if (hash_bytes(*part) != hash) throw std::invalid_argument("the hash of a part of " + name + " does not agree");
    parts.parts.push_back(*std::move(part));
  }
  return content_of(parts);
}

void write_model(sqlite::Database& database, int episode, const ModelParts& parts) {
  sqlite::Statement select = database.prepare(kSelectPart);
  sqlite::Statement write = database.prepare("INSERT OR REPLACE INTO parts VALUES (?, ?)");
  std::string hashes;
  for (const std::string& part : parts.parts) {
    const std::string hash = hash_bytes(part);
    if (find_part(select, hash) != part) write.bind_blob(hash).bind_blob(part).step();
    hashes += hash;
  }
  sqlite::Statement insert = database.prepare("INSERT OR REPLACE INTO models VALUES (?, ?, ?, ?)");
  insert.bind(std::int64_t{episode}).bind_blob(hash_of_model(episode, parts.head, hashes)).bind_blob(parts.head);
  insert.bind_blob(hashes).step();
}

void keep_models(sqlite::Database& database, std::int64_t models) {
  database.prepare("DELETE FROM models WHERE episode NOT IN (SELECT episode FROM models ORDER BY episode DESC LIMIT ?)")
      .bind(models)
      .step();
  remove_unnamed_parts(database);
}

void remove_after(sqlite::Database& database, int episode) {
  database.prepare("DELETE FROM models WHERE episode > ?").bind(std::int64_t{episode}).step();
  database.prepare("DELETE FROM episodes WHERE number > ?").bind(std::int64_t{episode}).step();
  remove_unnamed_parts(database);
}

std::vector<std::string> unnamed_parts(sqlite::Database& database) {
  std::unordered_set<std::string> named;
  sqlite::Statement model = database.prepare("SELECT parts FROM models");
  while (model.step()) {
    const std::string hashes = model.blob(0);
    for (std::size_t at = 0; at < hashes.size(); at += kHashBytes) named.insert(hashes.substr(at, kHashBytes));
  }
  std::vector<std::string> unnamed;
  sqlite::Statement part = database.prepare("SELECT hash FROM parts");
  while (part.step()) {
    std::string hash = part.blob(0);
    if (!named.contains(hash)) unnamed.push_back(std::move(hash));
  }
  return unnamed;
}

void require_plain(sqlite::Database& database) {
  constexpr std::string_view others =
      "SELECT count(*) FROM sqlite_schema WHERE NOT (type = 'table' AND rootpage > 0 OR type = 'index' AND sql IS "
      "NULL)";
  constexpr std::string_view computed =
      "SELECT count(*) FROM sqlite_schema AS tables, pragma_table_xinfo(tables.name) AS columns "
      "WHERE tables.type = 'table' AND columns.hidden <> 0";
  if (database.integer(others) + database.integer(computed) > 0)
    throw std::invalid_argument("it has more than plain tables");
  database.execute("PRAGMA ignore_check_constraints = ON");  // they are programs as well
}

void require_intact(sqlite::Database& database) {
  require_intact(database, "quick_check");
}

void require_all_intact(sqlite::Database& database) {
  require_intact(database, "integrity_check");
  sqlite::Database fresh(":memory:", SQLITE_OPEN_READWRITE);
  create(fresh);
  const char* const tables = "SELECT name, coalesce(sql, '') FROM sqlite_master ORDER BY name";
  sqlite::Statement ours = database.prepare(tables), wanted = fresh.prepare(tables);
  for (bool more = true; more;) {
    more = wanted.step();
    if (ours.step() != more || (more && (ours.text(0) != wanted.text(0) || ours.text(1) != wanted.text(1))))
      throw sqlite::Error(SQLITE_CORRUPT, "the tables are not those that sila makes");
  }
}

}  // namespace sila::tables
